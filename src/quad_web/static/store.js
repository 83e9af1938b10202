/**
 * The items that the server has sent, by key, with counters that say what has changed.
 */

/** Items by key, such as `poses` or `scan/3`; see `view/state.py` for the keys. */
export class Store {
  constructor() {
    this._items = new Map();
    this._kinds = new Map();
    this._revisions = new Map();
    this._revision = 0;
  }

  /**
   * Set and remove items.
   *
   * @param {{items: import("./codec.js").Item[], removed: string[]}} message
   */
  apply({ items, removed }) {
    for (const item of items) {
      const { kind, robot } = splitKey(item.key);
      this._revision += 1;
      const entry = { ...item, kind, robot, revision: this._revision };
      this._items.set(item.key, entry);
      if (!this._kinds.has(kind)) {
        this._kinds.set(kind, new Map());
      }
      this._kinds.get(kind).set(robot, entry);
      this._revisions.set(kind, this._revision);
    }
    for (const key of removed) {
      const { kind, robot } = splitKey(key);
      this._items.delete(key);
      this._kinds.get(kind)?.delete(robot);
      this._revision += 1;
      this._revisions.set(kind, this._revision);
    }
  }

  /** Remove everything. */
  clear() {
    this.apply({ items: [], removed: [...this._items.keys()] });
  }

  /** Return an item, undefined if there is none. */
  get(key) {
    return this._items.get(key);
  }

  /** Return the items of a kind, such as those of `scan/0`, `scan/1`, ... */
  all(kind) {
    const entries = this._kinds.get(kind);
    return entries ? [...entries.values()] : [];
  }

  /** Return a number that grows whenever an item of this kind changes. */
  revision(kind) {
    return this._revisions.get(kind) ?? 0;
  }
}

/** Split `scan/3` into its kind and the number of its robot (null without one). */
export function splitKey(key) {
  const slash = key.indexOf("/");
  if (slash < 0) {
    return { kind: key, robot: null };
  }
  return { kind: key.slice(0, slash), robot: Number(key.slice(slash + 1)) };
}
