/**
 * Vue component of what the browser draws by itself; `web/arena.py` is its side in Python.
 */

export default {
  props: {
    resource_path: String,
    module: String,
    state: Object,
  },

  template: "<div></div>",

  async mounted() {
    const folder = (window.path_prefix ?? "") + this.resource_path;
    const { View } = await import(`${folder}/${this.module}`);
    this.view = new View(this.$el, (name, value) => this.$emit(name, value));
    this.view.apply({ ...this.state, ...this.early });
  },

  unmounted() {
    this.view?.dispose();
  },

  watch: {
    state(state) {
      this.view?.apply(state);
    },
  },

  methods: {
    /** Take over changes of the state; those that come while the module loads are kept. */
    apply(changes) {
      this.early = { ...this.early, ...changes };
      this.view?.apply(changes);
    },
  },
};
