/**
 * Vue component of the charts; class `Charts` in `web/arena.py` is its side in Python.
 */

import "echarts";

export default {
  props: {
    resource_path: String,
    selected: Number,
  },

  render() {
    return Vue.h("div", { class: "quad-charts", role: "img", "aria-label": "Charts" });
  },

  async mounted() {
    const folder = (window.path_prefix ?? "") + this.resource_path;
    const { ChartsView } = await import(`${folder}/charts_view.js`);
    this.view = new ChartsView(this.$el, window.echarts);
    this.view.select(this.wanted === undefined ? (this.selected ?? null) : this.wanted);
  },

  unmounted() {
    this.view?.dispose();
  },

  methods: {
    /** Draw one robot's lines bold. */
    select(robot) {
      this.wanted = robot;
      this.view?.select(robot);
    },
  },
};
