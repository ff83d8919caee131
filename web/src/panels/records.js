// Records: list, download, replay.

import { byId, closable, element } from "./elements.js";

export class Records {
  constructor({ store, send, query }) {
    Object.assign(this, { store, send, query });
    this.dialog = closable(byId("records-dialog"));
    byId("records").addEventListener("click", () => this.open());
  }

  async open() {
    this.say("Reading the list …");
    this.dialog.showModal();
    try {
      this.fill(await this.fetchNames());
    } catch (error) {
      this.say(`The list could not be read: ${error.message}.`);
    }
  }

  async fetchNames() {
    const answer = await fetch(`api/records${this.query}`);
    if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
    const list = await answer.json();
    return (list.records ?? list).map((one) => one.name ?? one);
  }

  say(text) {
    byId("records-list").replaceChildren(element("li", { className: "quiet" }, text));
  }

  fill(names) {
    if (!names.length) return this.say("No records yet.");
    byId("records-list").replaceChildren(...names.map((name) => this.row(name)));
  }

  row(name) {
    const isRunning = name === this.store.state?.recording;
    const replay = element("button", { type: "button", disabled: !this.store.maySteer, ariaLabel: `Replay ${name}` }, "Replay");
    replay.title = this.store.maySteer ? "Shows it to everybody" : "Take control first";
    replay.addEventListener("click", () => this.replay(name));
    const join = this.query ? "&" : "?";
    const link = element("a", { href: `api/record${this.query}${join}name=${encodeURIComponent(name)}`, download: name, ariaLabel: `Download ${name}` }, "Download");
    return element("li", {}, element("span", { className: "name" }, name, isRunning ? " (recording)" : ""), link, replay);
  }

  replay(name) {
    this.send({ type: "replay", name });
    this.dialog.close();
  }
}
