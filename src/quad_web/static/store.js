/**
 * The items that the server has sent, by key.
 */

/** Items by key, such as `poses` or `scan/3`; see `view/state.py` for the keys. */
export class Store {
  constructor() {
    this._items = new Map();
    this._revision = 0;
  }

  /** Set and remove items. */
  apply({ items, removed }) {
    for (const item of items) {
      const [kind, robot] = item.key.split("/");
      this._revision += 1;
      const entry = { ...item, kind, robot: robot ? Number(robot) : null };
      this._items.set(item.key, { ...entry, revision: this._revision });
    }
    for (const key of removed) {
      this._items.delete(key);
    }
  }

  /** Remove everything. */
  clear() {
    this._items.clear();
  }

  /** Return an item with a `revision` that no other one has, undefined if there is none. */
  get(key) {
    return this._items.get(key);
  }

  /** Return the items of a kind, such as those of `scan/0`, `scan/1`, ... */
  all(kind) {
    return [...this._items.values()].filter((item) => item.kind === kind);
  }
}
