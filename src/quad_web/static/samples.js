/**
 * The last minute of the item `samples`: gap, clearance, speed and control-cycle time of each
 * robot.
 */

/** Seconds that are kept. */
export const SPAN_S = 60;
const SPACING_S = 0.1; // samples that are closer are left out
const COLUMNS = 4;

/** Samples in the order of time. */
export class SampleHistory {
  constructor() {
    this.clear();
  }

  /** Forget everything. */
  clear() {
    this.times = [];
    this.count = 0; // robots
    this._rows = [];
  }

  /**
   * Append what an item brings: one sample, and the ones before it in a connection's first message.
   *
   * @param {{data: {time_s: number}, arrays: Object<string, {values: any, shape: number[]}>}} item
   */
  add({ data, arrays }) {
    const { times, history, values } = arrays;
    if (times) {
      this.clear();
      const size = history.shape[1] * COLUMNS;
      times.values.forEach((time_s, i) => {
        this._append(time_s, history.values.subarray(i * size, (i + 1) * size));
      });
    }
    this._append(data.time_s, values.values);
  }

  /** Append a sample. A robot more or less, or a time that goes back, begins anew. */
  _append(time_s, values) {
    const newest_s = this.newest_s;
    if (values.length !== COLUMNS * this.count || time_s < newest_s) {
      this.clear();
      this.count = values.length / COLUMNS;
    } else if (time_s - newest_s < SPACING_S - 1e-6) {
      return;
    }
    this.times.push(time_s);
    this._rows.push(values);
    let old = 0;
    while (this.times[old] < time_s - SPAN_S) {
      old += 1;
    }
    this.times.splice(0, old);
    this._rows.splice(0, old);
  }

  /** Time of the last sample, -Infinity without one. */
  get newest_s() {
    return this.times.length ? this.times[this.times.length - 1] : -Infinity;
  }

  /** Return one value of one robot over time; NaN where it is unknown. */
  line(robot, column) {
    return this._rows.map((row) => row[COLUMNS * robot + column]);
  }

  /** Return the least and the greatest value of all robots over time; NaN where all are unknown. */
  band(column) {
    const least = [];
    const greatest = [];
    for (const row of this._rows) {
      let [low, high] = [Infinity, -Infinity];
      for (let i = column; i < row.length; i += COLUMNS) {
        if (Number.isFinite(row[i])) {
          low = Math.min(low, row[i]);
          high = Math.max(high, row[i]);
        }
      }
      least.push(low <= high ? low : NaN);
      greatest.push(low <= high ? high : NaN);
    }
    return { least, greatest };
  }
}
