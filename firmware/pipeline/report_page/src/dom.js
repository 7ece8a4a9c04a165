// Building blocks of the page. Whatever comes from the data becomes text or an attribute value, never markup.

const SVG_NAMESPACE = 'http://www.w3.org/2000/svg';

function apply(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) {
      element.addEventListener(name.slice(2), value);
    } else {
      element.setAttribute(name, value === true ? '' : String(value));
    }
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

/** An HTML element: h('button', { class: 'x', onclick: f }, 'text', child, [children]). */
export function h(tag, attributes, ...children) {
  return apply(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
export function s(tag, attributes, ...children) {
  return apply(document.createElementNS(SVG_NAMESPACE, tag), attributes, children);
}

/** A titled part of the page. */
export function section(id, title, ...children) {
  return h('section', { id, 'aria-labelledby': `${id}-title` }, h('h2', { id: `${id}-title` }, title), children);
}

/** A text bubble that follows the pointer; shared by all plots. */
export function createTooltip() {
  const bubble = h('div', { class: 'tooltip', role: 'status', hidden: true });
  document.body.append(bubble);
  return {
    show(clientX, clientY, ...lines) {
      bubble.replaceChildren(...lines.map((line, i) => h('div', { class: i === 0 ? 'strong' : null }, line)));
      bubble.hidden = false;
      const { width, height } = bubble.getBoundingClientRect();
      const left = Math.min(clientX + 14, window.innerWidth - width - 8);
      const top = clientY + 18 + height > window.innerHeight ? clientY - height - 12 : clientY + 18;
      bubble.style.left = `${Math.max(8, left)}px`;
      bubble.style.top = `${Math.max(8, top)}px`;
    },
    hide() {
      bubble.hidden = true;
    },
  };
}
