/**
 * Vue component of the arena; `web/arena.py` is its side in Python.
 */

export default {
  props: {
    resource_path: String,
    state: Object,
  },

  render() {
    const attributes = {
      class: "quad-arena",
      tabindex: 0,
      role: "application",
      "aria-label": "Arena: arrows move the view, plus and minus zoom, n and p select a robot",
    };
    return Vue.h("div", attributes);
  },

  async mounted() {
    const folder = (window.path_prefix ?? "") + this.resource_path;
    const { ArenaView } = await import(`${folder}/arena_view.js`);
    this.arena = new ArenaView(this.$el, (name, value) => this.$emit(name, value));
    this.arena.apply(this.state);
  },

  unmounted() {
    this.arena?.dispose();
  },

  watch: {
    state(state) {
      this.arena?.apply(state);
    },
  },

  methods: {
    /** Take over changes of the state; see `ArenaView.apply`. */
    apply(changes) {
      this.arena?.apply(changes);
    },
  },
};
