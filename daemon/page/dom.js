// Elements, built by text: nothing that came from outside is ever read as markup.

const SVG = "http://www.w3.org/2000/svg";

function put(element, name, value) {
    if (value === null || value === undefined || value === false)
        return;
    if (name === "on")
        for (const [event, call] of Object.entries(value))
            element.addEventListener(event, call);
    else if (name === "test")
        element.dataset.test = value;
    else if (name === "data")
        Object.assign(element.dataset, value);
    else if (name === "style")
        for (const [property, text] of Object.entries(value))
            element.style.setProperty(property, text);
    else if (name === "value" || name === "checked" || name === "selected")
        element[name] = value;
    else
        element.setAttribute(name, value === true ? "" : value);
}

function add(element, children) {
    for (const child of children.flat(Infinity))
        if (child !== null && child !== undefined && child !== false)
            element.append(child); // a string becomes a text node
}

// h("p", {class: "why", test: "notice", on: {click: f}, data: {state: "red"}, style: {width: "3%"}}, "text", [more])
export function h(tag, props = {}, ...children) {
    const element = document.createElement(tag);

    add(element, children); // before the properties: a select has its value only when it has its options
    for (const [name, value] of Object.entries(props))
        put(element, name, value);
    return element;
}

export function svg(tag, props = {}, ...children) {
    const element = document.createElementNS(SVG, tag);

    for (const [name, value] of Object.entries(props))
        put(element, name, value);
    add(element, children);
    return element;
}

// What is in it goes, this comes.
export function fill(element, ...children) {
    element.replaceChildren();
    add(element, children);
    return element;
}

// Sets text only where it differs: a live region that is written again is read aloud again.
export function setText(element, text) {
    if (element.textContent !== text)
        element.textContent = text;
}

let count = 0;
export function newId(stem) {
    count += 1;
    return `${stem}-${count}`;
}
