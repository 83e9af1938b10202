/**
 * A table whose rows the server changes by key: Quasar's table, which draws the visible rows only.
 *
 * Columns are Quasar's, each with a `kind` that says how its cells are drawn. Everything is shown as
 * text; nothing is interpreted as HTML.
 */

const END_PX = 40;

/** Order of a column's values: numbers by size, texts by locale, missing ones last. */
export function compare(a, b) {
  const [x, y] = [Array.isArray(a) ? a[1] - a[0] : a, Array.isArray(b) ? b[1] - b[0] : b];
  const missing = (value) => value === null || value === undefined || value === "";
  if (missing(x) || missing(y)) {
    return missing(x) - missing(y);
  }
  return typeof x === "number" ? x - y : String(x).localeCompare(String(y));
}

/** Return whether a row has all the values of `equal`, and the text in one of its cells. */
export function matches(row, { text, equal }) {
  const isEqual = ([field, values]) => values.includes(row[field]);
  if (!Object.entries(equal).every(isEqual)) {
    return false;
  }
  const sought = text.toLowerCase();
  return !sought || Object.values(row).some((v) => String(v).toLowerCase().includes(sought));
}

export default {
  template: `
    <q-table ref="table" class="live-table" flat dense square virtual-scroll hide-pagination
      binary-state-sort row-key="key" :virtual-scroll-item-size="30"
      :rows="shown" :columns="sortable" v-model:pagination="pagination"
      :rows-per-page-options="[0]" :no-data-label="empty" @virtual-scroll="scrolled">
      <template v-slot:body="props">
        <q-tr :props="props" :class="rowClasses(props.row)" :data-key="props.row.key"
          :data-testid="testid + '-row-' + props.row.key" @click="$emit('pick', props.row.key)"
          :data-index="props.pageIndex" :tabindex="tabindex(props.pageIndex)"
          @focus="current = props.pageIndex" @keydown="key($event, props)">
          <q-td v-for="column in props.cols" :key="column.name" :props="props"
            :class="'cell-' + column.kind" :title="hint(column, props.row)">
            <template v-if="column.kind === 'robot'"><span v-if="props.row.colour" class="dot"
              :style="{ background: props.row.colour }"></span>{{ shownText(column, props.row) }}</template>
            <span v-else-if="column.kind === 'state'" class="chip state" :data-state="column.value">{{
              column.value }}</span>
            <span v-else-if="column.kind === 'level'" class="level" :data-level="column.value">{{
              column.value }}</span>
            <span v-else-if="column.kind === 'battery'" class="battery">
              <i v-for="n in cells(column.value)" :key="n"
                :class="{ full: n > column.value[0] }"></i>
            </span>
            <template v-else>{{ shownText(column, props.row) }}</template>
          </q-td>
        </q-tr>
      </template>
    </q-table>`,
  props: {
    columns: Array,
    testid: String,
    empty: String,
    picks: Boolean,
    follow: Boolean,
    limit: Number,
    sort: Object,
  },
  data() {
    return {
      rows: [],
      selected: null,
      current: 0, // place of the row that Tab reaches
      wanted: { text: "", equal: {} },
      pagination: { rowsPerPage: 0, ...this.sort },
    };
  },
  computed: {
    sortable() {
      return this.columns.map((column) => ({ ...column, sort: compare }));
    },
    shown() {
      return this.rows.filter((row) => matches(row, this.wanted));
    },
  },
  mounted() {
    this.body = this.$el.querySelector(".q-table__middle");
    if (!this.picks) {
      this.body.tabIndex = 0; // arrows scroll it
    }
    if (this.follow) {
      let height = 0;
      new ResizeObserver(() => {
        if (!height) {
          this.toEnd(); // its tab is opened
        }
        height = this.body.clientHeight;
      }).observe(this.body);
    }
  },
  methods: {
    /** One row that can be picked is in the order of Tab; arrows lead to the others. */
    tabindex(place) {
      return this.picks ? (place === this.current ? 0 : -1) : undefined;
    },
    key(event, { row, pageIndex }) {
      const last = this.shown.length - 1;
      const places = { ArrowDown: pageIndex + 1, ArrowUp: pageIndex - 1, Home: 0, End: last };
      if (!this.picks || event.target !== event.currentTarget) {
        return;
      }
      if (event.key === "Enter" || event.key === " ") {
        this.$emit("pick", row.key);
      } else if (places[event.key] !== undefined) {
        this.focusRow(Math.max(0, Math.min(places[event.key], last)));
      } else {
        return;
      }
      event.preventDefault();
    },
    /** Focus a row; one out of view is there only after it was scrolled to. */
    async focusRow(place) {
      const line = () => this.$el.querySelector(`[data-index="${place}"]`);
      if (!line()) {
        this.$refs.table.scrollTo(place);
        await new Promise(requestAnimationFrame);
        await this.$nextTick();
      }
      line()?.focus();
    },
    /** Keep the row that Tab reaches among those that are there. */
    scrolled({ from, to }) {
      this.current = Math.max(from, Math.min(this.current, to));
    },
    /** Change cells of rows, append new rows, remove others. */
    patch(changed, removed) {
      const isAtEnd = this.isAtEnd();
      const gone = new Set(removed);
      let rows = gone.size ? this.rows.filter((row) => !gone.has(row.key)) : [...this.rows];
      const places = new Map(rows.map((row, index) => [row.key, index]));
      for (const cells of changed) {
        const place = places.get(cells.key) ?? rows.length;
        rows[place] = Object.freeze({ ...rows[place], ...cells });
        places.set(cells.key, place);
      }
      this.rows = this.limit ? rows.slice(-this.limit) : rows;
      if (this.follow && isAtEnd) {
        this.toEnd();
      }
    },
    /** Remove all rows. */
    clear() {
      this.rows = [];
    },
    /** Mark a row, and bring it into view. */
    select(key) {
      this.selected = key;
      const rows = this.$refs.table.filteredSortedRows ?? this.shown;
      const place = rows.findIndex((row) => row.key === key);
      this.current = Math.max(0, place);
      const line = this.$el.querySelector(`[data-key="${CSS.escape(String(key))}"]`);
      if (place >= 0 && !line) {
        this.$refs.table.scrollTo(place, "center");
      } else {
        line?.scrollIntoView({ block: "nearest" });
      }
    },
    /** Show only rows with a text, and with one of the values in each field of `equal`. */
    filter(text, equal) {
      this.wanted = { text, equal };
      if (this.follow) {
        this.toEnd();
      }
    },
    isAtEnd() {
      const { body } = this;
      return !body || body.scrollHeight - body.scrollTop - body.clientHeight < END_PX;
    },
    toEnd() {
      this.$nextTick(() => this.body.scrollTo(0, this.body.scrollHeight));
    },
    rowClasses(row) {
      return { "is-selected": row.key === this.selected, "is-lost": row.lost === true };
    },
    cells(value) {
      return Array.isArray(value) ? Math.min(value[1], 12) : 0;
    },
    hint(column, row) {
      if (column.kind === "battery" && column.value) {
        return `${column.value[1] - column.value[0]} of ${column.value[1]} recoveries left`;
      }
      return column.hint ? row[column.hint] : undefined;
    },
    shownText(column, row) {
      const value = row[column.field];
      if (value === null || value === undefined) {
        return "–";
      }
      return typeof value === "number" && column.digits !== undefined
        ? value.toFixed(column.digits)
        : String(value);
    },
  },
};
