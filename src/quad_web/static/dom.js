/**
 * Elements of the page, made without markup: whatever they say is text.
 */

/** Make an element; attributes that are functions are listeners: `{click: () => ...}`. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") {
      element.addEventListener(name, value);
    } else if (value !== undefined && value !== false) {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
  element.append(...children);
  return element;
}

/** Make a button with an icon of Material Icons, which NiceGUI serves. */
export function iconButton(icon, label, action) {
  return make(
    "button",
    { type: "button", class: "quad-button", title: label, "aria-label": label, click: action },
    make("i", { class: "material-icons", "aria-hidden": "true" }, icon),
  );
}

/** Set the text of an element, if it is another one. */
export function say(element, text) {
  if (element.textContent !== text) {
    element.textContent = text;
  }
}
