// Elements of a page: the one of an id, and new ones.

export const find = (id) => document.getElementById(id);

export function element(name, text, style = "") {
  const made = document.createElement(name);
  made.textContent = text;
  made.className = style;
  return made;
}
