/**
 * What lies over the arena: buttons, scale bar, coordinates, hint, menu, and the notice of a dead
 * link.
 */

import { iconButton, make, say } from "./dom.js";
import { Legend } from "./legend.js";
import { formatLength, roundLength } from "./viewport.js";

const SCALE_BAR_PX = 120;
const WIDE_PX = 700; // narrower arenas begin with the legend folded
const TOOLBAR_PX = 46; // height of the page's own toolbar
const NOTE_MS = 6000;
const REFUSED =
  "The server was restarted and has new tokens: open the address that it has printed. " +
  "This page then comes back by itself.";

/** The elements over the arena. */
export class Hud {
  /** Actions are fit, zoom, follow, leave, and covered: panels cover another part. */
  constructor(root, actions) {
    this._root = root;
    this._follow = iconButton("my_location", "Follow the selected robot", actions.follow);
    this._legendButton = iconButton("help_outline", "Legend", () => this._toggleLegend());
    this.legend = new Legend();
    this._buttons = make(
      "div",
      { class: "quad-buttons", role: "toolbar", "aria-label": "View" },
      iconButton("zoom_in", "Zoom in", () => actions.zoom(1.4)),
      iconButton("zoom_out", "Zoom out", () => actions.zoom(1 / 1.4)),
      iconButton("fit_screen", "Show the whole arena", actions.fit),
      this._follow,
      this._legendButton,
    );
    this._bar = make("div", { class: "quad-scale-bar" });
    this._barText = make("span");
    this.place = make("div", { class: "quad-place" });
    this._hintText = make("span");
    this._hint = make(
      "div",
      { class: "quad-hint", role: "status", hidden: true },
      this._hintText,
      iconButton("close", "Leave the tool (Escape)", actions.leave),
    );
    this._note = make("div", { class: "quad-note", role: "alert", hidden: true });
    this._menu = make("div", { class: "quad-menu", role: "menu", hidden: true });
    root.append(
      this._buttons,
      make(
        "div",
        { class: "quad-foot" },
        make("div", { class: "quad-scale" }, this._bar, this._barText),
        this.place,
      ),
      this.legend.element,
      this._hint,
      this._note,
      this._menu,
    );
    if (root.clientWidth >= WIDE_PX) {
      this._toggleLegend();
    }
    this._covers = actions.covered;
  }

  _toggleLegend() {
    const isOpen = this.legend.toggle();
    this._legendButton.setAttribute("aria-pressed", String(isOpen));
    this._covers?.(); // which draws, and fills the legend
  }

  /** Pixels that panels cover on each side. */
  get covered() {
    const legend = this.legend.element;
    return {
      left: legend.hidden ? 0 : legend.offsetLeft + legend.offsetWidth + 8,
      right: this._buttons.offsetWidth + 18,
      top: this._root.clientWidth < WIDE_PX ? TOOLBAR_PX : 0, // else it is beside the arena
    };
  }

  /** Show how long a length is; null where it depends on the distance. */
  setScale(metresPerPixel) {
    if (!metresPerPixel) {
      this._bar.parentElement.hidden = true;
      return;
    }
    const metres = roundLength(SCALE_BAR_PX * metresPerPixel);
    this._bar.parentElement.hidden = false;
    this._bar.style.width = `${Math.round(metres / metresPerPixel)}px`;
    say(this._barText, formatLength(metres));
  }

  /** Show whether the selected robot is followed, and whether one is selected. */
  setFollow(isFollowing, isPossible) {
    this._follow.disabled = !isPossible;
    this._follow.setAttribute("aria-pressed", String(isFollowing));
  }

  /** Show what the tool does; "" hides it. */
  setHint(text) {
    say(this._hintText, text);
    this._hint.hidden = !text;
  }

  /** Show a sentence for some seconds. */
  note(text) {
    say(this._note, text);
    this._note.hidden = !text;
    clearTimeout(this._noteTimer);
    this._noteTimer = setTimeout(() => {
      this._note.hidden = true;
    }, NOTE_MS);
  }

  /** Show a menu of [text, action, whether it is possible] until something else is pressed. */
  showMenu({ px, py }, title, entries) {
    const items = entries.map(([text, action, isPossible]) => {
      const act = () => {
        this.hideMenu();
        action();
      };
      const attributes = { type: "button", role: "menuitem", disabled: !isPossible, click: act };
      return make("button", attributes, text);
    });
    this._menu.replaceChildren(make("div", { class: "quad-menu-title" }, title), ...items);
    this._menu.hidden = false;
    const { clientWidth, clientHeight } = this._root;
    const { offsetWidth, offsetHeight } = this._menu;
    this._menu.style.left = `${Math.max(4, Math.min(px, clientWidth - offsetWidth - 4))}px`;
    this._menu.style.top = `${Math.max(4, Math.min(py, clientHeight - offsetHeight - 4))}px`;
    items.find((item) => !item.disabled)?.focus();
  }

  /** Close the menu; return whether it was open. */
  hideMenu() {
    const wasOpen = !this._menu.hidden;
    this._menu.hidden = true;
    return wasOpen;
  }
}

/** A bar at the top of the page that says how long the link has been silent, or what to do. */
export class LinkNotice {
  /** @param {import("./link.js").Link} link */
  constructor(link) {
    this._link = link;
    this._text = make("span");
    this._element = make(
      "div",
      { class: "quad-link-notice", role: "alert", hidden: true },
      make("i", { class: "material-icons", "aria-hidden": "true" }, "cloud_off"),
      this._text,
    );
    document.body.append(this._element);
    this._onState = () => this._update();
    link.addEventListener("state", this._onState);
    this._update();
  }

  /** Take the bar away. */
  dispose() {
    this._link.removeEventListener("state", this._onState);
    this._element.remove();
  }

  _update() {
    const { isAlive, isRefused, silence_s } = this._link;
    const isDead = !isAlive && silence_s >= 1;
    document.body.classList.toggle("quad-link-dead", isDead);
    this._element.hidden = !isDead;
    const text = `No data for ${Math.floor(silence_s)} s, reconnecting`;
    say(this._text, isRefused ? REFUSED : text);
  }
}
