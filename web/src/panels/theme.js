// Dark or light: as the system says, or as the switch was left.

const STORED = "tendonrod.theme";
const NAMES = { ground: "--ground", text: "--text", quiet: "--quiet", line: "--line", good: "--good", warn: "--warn", bad: "--bad", trace: "--trace", target: "--target",
  insertion: "--lane-insertion", tension: "--lane-tension", clearance: "--lane-clearance" };

export class Theme {
  constructor(button, onChange) {
    Object.assign(this, { button, onChange, system: matchMedia("(prefers-color-scheme: light)") });
    this.system.addEventListener("change", () => this.apply());
    button.addEventListener("click", () => this.toggle());
    this.apply();
  }

  get isLight() {
    const chosen = read();
    return chosen ? chosen === "light" : this.system.matches;
  }

  toggle() {
    try {
      localStorage.setItem(STORED, this.isLight ? "dark" : "light");
    } catch {
      // private mode: the system's choice stays
    }
    this.apply();
  }

  apply() {
    document.documentElement.dataset.theme = this.isLight ? "light" : "dark";
    this.button.textContent = this.isLight ? "Dark" : "Light";
    this.button.ariaLabel = `${this.button.textContent} colours`;
    const style = getComputedStyle(document.documentElement);
    this.colours = Object.fromEntries(Object.entries(NAMES).map(([key, name]) => [key, style.getPropertyValue(name).trim()]));
    this.colours.isLight = this.isLight;
    this.colours.font = "11px system-ui, sans-serif";
    this.onChange();
  }
}

function read() {
  try {
    return localStorage.getItem(STORED);
  } catch {
    return null;
  }
}
