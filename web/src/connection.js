// The socket to the server: reconnects by itself, and takes silence for a lost connection.

const SILENCE_MS = 1500; // the server speaks at least ten times a second
const WATCH_MS = 250;
const RETRY_MS = [250, 500, 1000, 2000];

export class Connection {
  /** `onMessage(message)`, `onStatus(isConnected)`; nothing is sent or kept while there is no connection. */
  constructor(url, { onMessage, onStatus }) {
    Object.assign(this, { url, onMessage, onStatus, tries: 0, heard: 0, watched: 0, isOpen: false });
    this.open();
    setInterval(() => this.watch(), WATCH_MS);
  }

  open() {
    this.socket = new WebSocket(this.url);
    const socket = this.socket;
    socket.onmessage = (event) => socket === this.socket && this.take(event.data);
    socket.onclose = () => socket === this.socket && this.lose();
  }

  take(text) {
    this.heard = performance.now();
    this.tries = 0;
    const message = JSON.parse(text);
    if (!this.isOpen && message.type === "welcome") this.change(true);
    this.onMessage(message);
  }

  change(isOpen) {
    this.isOpen = isOpen;
    this.onStatus(isOpen);
  }

  lose() {
    this.socket = null;
    if (this.isOpen) this.change(false);
    const wait = RETRY_MS[Math.min(this.tries, RETRY_MS.length - 1)];
    this.tries += 1;
    setTimeout(() => this.open(), wait);
  }

  /** A page that was held up has messages waiting: it is judged only when it had time to hear them. */
  watch() {
    const now = performance.now();
    const isOnTime = now - this.watched < 2 * WATCH_MS;
    this.watched = now;
    if (this.isOpen && isOnTime && now - this.heard > SILENCE_MS) this.drop();
  }

  /** Gives this connection up at once: a dead link may take minutes to report its end. */
  drop() {
    const silent = this.socket;
    this.lose();
    silent?.close();
  }

  /** True if the message went out. */
  send(message) {
    if (!this.isOpen || this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}

/** The address of the server's socket beside this page, with the page's own query (it may hold the token). */
export function socketUrl(location) {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  const folder = location.pathname.replace(/[^/]*$/, "");
  return `${scheme}//${location.host}${folder}ws${location.search}`;
}
