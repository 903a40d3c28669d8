// The element <jostle-scene src="scene.toml">, which plays a scene file in any page. The page of Jostle lies in the same
// folder as this file, and is loaded once the element is seen.
//
// Attributes: src, the address of the scene file; bots, their number; controls, to show buttons, names and news too.
// Width and height come from CSS; without them, the element is as wide as its surroundings allow.

const FOLDER = new URL("./", import.meta.url);
const STYLE = `
  :host { display: block; position: relative; aspect-ratio: 16 / 9; background: #090c1a; }
  :host([hidden]) { display: none; }
  iframe { position: absolute; inset: 0; width: 100%; height: 100%; border: 0; }
  p { position: absolute; inset: 0; display: grid; place-content: center; margin: 0; padding: 1rem; color: #f2efe4; font: 1rem/1.4 system-ui, sans-serif; text-align: center; }
`;

// The text of a scene as in a link: deflated, in base64url without padding.
async function packed(text) {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const letters = Array.from(bytes, byte => String.fromCharCode(byte)).join("");
  return btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

class JostleScene extends HTMLElement {
  static observedAttributes = ["src", "bots", "controls"];

  #seen = new IntersectionObserver(entries => {
    if (entries.some(entry => entry.isIntersecting)) {
      this.#seen.disconnect();
      this.#start();
    }
  });
  #shown = document.createElement("div");
  // Counts the starts, so that a file that comes late does not replace a newer one.
  #starts = 0;

  constructor() {
    super();
    const style = document.createElement("style");
    style.textContent = STYLE;
    this.attachShadow({ mode: "open" }).append(style, this.#shown);
  }

  connectedCallback() {
    this.#seen.observe(this);
  }

  disconnectedCallback() {
    this.#seen.disconnect();
    this.#starts += 1;
    this.#shown.replaceChildren();
  }

  attributeChangedCallback() {
    if (this.#starts > 0 && this.isConnected) {
      this.#start();
    }
  }

  async #start() {
    const start = this.#starts += 1;
    const shown = await this.#frame().catch(error => {
      const note = document.createElement("p");
      note.textContent = `This scene can't be played: ${error.message}`;
      return note;
    });
    if (start === this.#starts) {
      this.#shown.replaceChildren(shown);
    }
  }

  async #frame() {
    const file = await fetch(new URL(this.getAttribute("src") ?? "", document.baseURI));
    if (!file.ok) {
      throw new Error(`${file.url} answers ${file.status}.`);
    }
    const bots = this.hasAttribute("bots") ? `&bots=${Number(this.getAttribute("bots"))}` : "";
    const bare = this.hasAttribute("controls") ? "" : "&bare=1";
    const frame = document.createElement("iframe");
    frame.title = this.title || "Jostle";
    frame.allow = "autoplay; clipboard-write; fullscreen; gamepad";
    frame.src = `${FOLDER}#scene=${await packed(await file.text())}${bots}${bare}`;
    return frame;
  }
}

customElements.define("jostle-scene", JostleScene);
