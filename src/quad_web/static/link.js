/**
 * The connection to the server's `/stream`, one for the whole page.
 *
 * The server sends the next frame only after the last one was acknowledged, which happens once it
 * is drawn: a slow page gets fewer frames, and no queue builds up.
 */

import { decode } from "./codec.js";
import { Store } from "./store.js";

/** Seconds of silence after which the link counts as dead. */
export const SILENCE_S = 2.0;
const CHECK_MS = 250;
const FIRST_RETRY_MS = 100;
const LONGEST_RETRY_MS = 1000;
const LONGEST_DRAW_MS = 1000;
const PROBE = "/favicon.ico"; // the page itself would be built anew
const FORBIDDEN = 403;

/**
 * A connection that comes back by itself.
 *
 * Events: `frame` after the items of a message are in the store (listeners draw), `state` when the
 * link dies, stays dead for another while, or comes back.
 *
 * `isRefused` is true while the server answers, but refuses this page: after a restart it has other
 * tokens, unless they were given.
 */
export class Link extends EventTarget {
  /** @param {string} url Address of the stream, `ws://...`. */
  constructor(url) {
    super();
    this.url = url;
    this.store = new Store();
    this.isAlive = false;
    this.isRefused = false;
    this._wanted = { layers: [], robot: null, every: true };
    this._heard_ms = performance.now();
    this._retry_ms = FIRST_RETRY_MS;
    this._messages = Promise.resolve();
    this._connect();
    setInterval(() => this._check(), CHECK_MS);
  }

  /** Ask for layers; `every` is false for costly ones of the selected robot only. */
  want(layers, robot, every) {
    const wanted = { layers: [...layers].sort(), robot, every };
    if (JSON.stringify(wanted) !== JSON.stringify(this._wanted)) {
      this._wanted = wanted;
      this._send({ want: wanted });
    }
  }

  /** Seconds since the last message. */
  get silence_s() {
    return (performance.now() - this._heard_ms) / 1000;
  }

  _connect() {
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this._socket = socket;
    this._tried_ms = performance.now();
    this._isFirst = true;
    const ifCurrent = (handler) => (event) => {
      if (this._socket === socket) {
        handler(event);
      }
    };
    socket.onopen = ifCurrent(() => this._send({ want: this._wanted }));
    socket.onclose = ifCurrent(() => this._retry());
    socket.onmessage = ifCurrent((event) => {
      this._heard_ms = performance.now();
      this._messages = this._messages.then(() => this._receive(socket, event.data));
    });
  }

  _retry() {
    const socket = this._socket;
    this._socket = null;
    socket?.close();
    setTimeout(() => this._connect(), this._retry_ms);
    this._retry_ms = Math.min(2 * this._retry_ms, LONGEST_RETRY_MS);
  }

  _send(message) {
    if (this._socket?.readyState === WebSocket.OPEN) {
      this._socket.send(JSON.stringify(message));
    }
  }

  async _receive(socket, buffer) {
    if (this._socket !== socket) {
      return;
    }
    try {
      const message = await decode(buffer);
      if (this._socket !== socket) {
        return;
      }
      if (this._isFirst) {
        this.store.clear(); // the server starts again from nothing
        this._isFirst = false;
        this._retry_ms = FIRST_RETRY_MS;
      }
      this.store.apply(message);
      this._setAlive(true);
      await this._draw(message);
    } catch (error) {
      console.error("stream: a message was not understood; connecting again", error);
      if (this._socket === socket) {
        this._retry();
      }
    }
  }

  async _draw({ header, items, removed }) {
    if (items.length || removed.length) {
      await nextFrame();
      this.dispatchEvent(new CustomEvent("frame"));
    }
    this._send({ ack: header.seq });
  }

  _check() {
    if (this.silence_s < SILENCE_S) {
      return;
    }
    this._setAlive(false);
    const wasTried_s = (performance.now() - this._tried_ms) / 1000;
    if (this._socket && wasTried_s > SILENCE_S) {
      this._retry(); // open but silent, or neither accepted nor refused
    }
    this._askWhy();
  }

  /** Ask the server whether it refuses this page; a browser does not tell of a WebSocket. */
  async _askWhy() {
    if (this._isAsking) {
      return;
    }
    this._isAsking = true;
    try {
      const signal = AbortSignal.timeout(1000 * SILENCE_S);
      const answer = await fetch(PROBE, { method: "HEAD", cache: "no-store", signal });
      this.isRefused = !this.isAlive && answer.status === FORBIDDEN;
    } catch (error) {
      this.isRefused = false; // no server, or one that does not answer
    }
    setTimeout(() => (this._isAsking = false), LONGEST_RETRY_MS);
  }

  _setAlive(isAlive) {
    if (isAlive && this.isAlive) {
      return;
    }
    this.isAlive = isAlive;
    this.isRefused = this.isRefused && !isAlive;
    this.dispatchEvent(new CustomEvent("state"));
  }
}

/** Wait until the browser draws; a hidden page draws nothing and goes on at once. */
function nextFrame() {
  if (document.hidden) {
    return Promise.resolve();
  }
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, LONGEST_DRAW_MS); // hidden while it waited
    requestAnimationFrame(() => {
      clearTimeout(timer);
      resolve();
    });
  });
}

let shared = null;

/** Return the connection of this page, which all its elements share. */
export function sharedLink() {
  if (!shared) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    shared = new Link(`${scheme}://${location.host}/stream`);
  }
  return shared;
}
