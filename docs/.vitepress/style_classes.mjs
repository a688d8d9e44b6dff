// Code is coloured when the site is built, with a style for each word. The gateway's policy takes no styles inside of a
// page, so each different one becomes a class, and all of them a file.
export class StyleClasses {
  #names = new Map();

  /** For `markdown.codeTransformers`. */
  transformer() {
    const replace = (node) => {
      const style = node.properties?.style;
      if (typeof style === "string") {
        delete node.properties.style;
        this.#add(node, style);
      }
      for (const child of node.children ?? []) replace(child);
    };
    return { name: "style-classes", enforce: "post", root: replace };
  }

  css() {
    return [...this.#names]
      .map(([style, name]) => `.${name}{${style}}\n`)
      .sort()
      .join("");
  }

  #add(node, style) {
    if (!this.#names.has(style)) this.#names.set(style, `c${style.replace(/--shiki-|[^\w]/g, "")}`);
    const name = this.#names.get(style);
    const known = node.properties.class;
    node.properties.class = Array.isArray(known) ? [...known, name] : known ? `${known} ${name}` : name;
  }
}
