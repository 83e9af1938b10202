// Chromium starts no worker on a page of a folder (file://): there, the search runs in a hidden
// frame. The plugin `offline` takes this file by its name; without it, it names one of a CDN.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.title = "search";
      frame.answer = (data) => this.dispatchEvent(new MessageEvent("message", {data}));
      frame.srcdoc = `<!doctype html><html lang="en"><title>search</title>
        <script>postMessage = (data) => frameElement.answer(data);</script>
        <script src="${url}"></script></html>`;
      this._inside = new Promise((resolve) => {
        frame.addEventListener("load", () => resolve(frame.contentWindow));
      });
      document.body.append(frame);
    }

    async postMessage(data) {
      (await this._inside).dispatchEvent(new MessageEvent("message", {data}));
    }
  };
}
