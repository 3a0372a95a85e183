// Short functions that create elements.

type Child = Node | string | null | undefined | false;
type Properties = Record<string, string | boolean | ((event: Event) => void)>;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false) element.setAttribute(name, value);
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined && child !== false));
  return element;
}

export function show(kind: "" | "wide" | "full", ...children: Child[]): HTMLElement {
  const main = document.getElementById("main") as HTMLElement;
  main.className = kind;
  main.replaceChildren(...children.filter((child): child is Node | string => !!child));
  return main;
}

/** Returns the current colour of the style; colours that depend on the theme are resolved on an element. */
export function colour(name: string): string {
  const probe = h("span");
  document.body.append(probe);
  probe.style.setProperty("color", `var(${name})`);
  const resolved = getComputedStyle(probe).color;
  probe.remove();
  return resolved;
}

export function button(text: string, act: () => void, properties: Properties = {}): HTMLButtonElement {
  return h("button", { type: "button", click: act, ...properties }, text);
}
