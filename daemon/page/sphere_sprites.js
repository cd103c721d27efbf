// The marks of frames: a shape and a colour for each kind, so that neither is needed alone. One picture holds them all; both
// ways of drawing the sphere, and the legend, take them from here. Colours are CSS variables (`--kind-NAME`, hexadecimal)
// and change with the theme; the palette is after Okabe and Ito, "Color Universal Design", 2008.
import { KINDS } from "./sphere.js";

// In a square from −1 to 1; `line`: drawn as an outline of that width instead of filled.
const SHAPES = {
    planned: { path: "M.6 0A.6.6 0 1 1-.6 0 .6.6 0 1 1 .6 0Z", line: 0.18 },
    way: { path: "M.62 0A.62.62 0 1 1-.62 0 .62.62 0 1 1 .62 0ZM.16 0A.16.16 0 1 1-.16 0 .16.16 0 1 1 .16 0Z", line: 0.26 },
    stored: { path: "M-.55-.55H.55V.55H-.55Z" },
    again: { path: "M-.55-.55H.55V.55H-.55Z", line: 0.24 },
    good: { path: "M.68 0A.68.68 0 1 1-.68 0 .68.68 0 1 1 .68 0Z" },
    retaken: { path: "M.74 0A.74.74 0 1 1-.74 0 .74.74 0 1 1 .74 0ZM-.13-.45H.13V-.13H.45V.13H.13V.45H-.13V.13H-.45V-.13H-.13Z" },
    soft: { path: "M0-.9.9 0 0 .9-.9 0Z" },
    clipped: { path: "M-.8-.8H.8V-.12H-.8ZM-.8.12H.8V.8H-.8Z" },
    rejected: { path: "M0-.88.9.74H-.9Z" },
    missing: { path: "M-.72-.72.72.72M.72-.72-.72.72", line: 0.42 },
    arm: { path: "M.8 0A.8.8 0 1 1-.8 0 .8.8 0 1 1 .8 0Z", line: 0.22 },
};
export const ARM = KINDS.length; // the sprite's column
export const CELL = 64;
export const COLUMNS = 16;
export const ROWS = 2; // the second: chosen

const SVG = "http://www.w3.org/2000/svg";

// For the legend and wherever a kind is named in text; it says nothing to a screen reader, the text beside it does.
export function mark(name) {
    const shape = SHAPES[name], svg = document.createElementNS(SVG, "svg"), path = document.createElementNS(SVG, "path");

    svg.setAttribute("viewBox", "-1 -1 2 2");
    svg.setAttribute("class", `mark mark-${name}`);
    svg.setAttribute("aria-hidden", "true");
    path.setAttribute("d", shape.path);
    path.setAttribute("fill-rule", "evenodd");
    if (shape.line)
        path.setAttribute("stroke-width", String(shape.line));
    path.setAttribute("class", shape.line ? "mark-line" : "mark-area");
    svg.append(path);
    return svg;
}

// The colours as they are now in `element`: of kinds, and of what is around them.
export function colours(element) {
    const style = getComputedStyle(element), of = (name, otherwise) => style.getPropertyValue(name).trim() || otherwise;
    const found = { line: of("--sphere-line", "#808890"), arm: of("--kind-arm", "#ffffff"), ring: of("--kind-ring", "#ffffff"),
        edge: of("--sphere-edge", "#101418") };

    for (const kind of KINDS)
        found[kind.name] = of(`--kind-${kind.name}`, "#808890");
    return found;
}

// "#rrggbb" as three numbers from 0 to 1.
export function rgb(hex) {
    const value = parseInt(hex.slice(1), 16);

    return [(value >> 16) / 255, ((value >> 8) & 255) / 255, (value & 255) / 255];
}

function drawShape(context, shape, colour, edge) {
    const path = new Path2D(shape.path);

    context.lineJoin = "round";
    if (shape.line) {
        context.strokeStyle = edge;
        context.lineWidth = shape.line + 0.14;
        context.stroke(path);
        context.strokeStyle = colour;
        context.lineWidth = shape.line;
        context.stroke(path);
        return;
    }
    context.strokeStyle = edge;
    context.lineWidth = 0.14;
    context.stroke(path);
    context.fillStyle = colour;
    context.fill(path, "evenodd");
}

// A canvas with COLUMNS × ROWS cells: kinds, then the arm; below them the same as chosen.
export function sprites(palette) {
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");

    canvas.width = CELL * COLUMNS;
    canvas.height = CELL * ROWS;
    [...KINDS.map((kind) => kind.name), "arm"].forEach((name, column) => {
        for (let row = 0; row < ROWS; row++) {
            context.setTransform(CELL * 0.36, 0, 0, CELL * 0.36, CELL * (column + 0.5), CELL * (row + 0.5));
            drawShape(context, SHAPES[name], palette[name], palette.edge);
            if (row) {
                context.beginPath();
                context.arc(0, 0, 1.18, 0, 2 * Math.PI);
                context.strokeStyle = palette.edge;
                context.lineWidth = 0.4;
                context.stroke();
                context.strokeStyle = palette.ring;
                context.lineWidth = 0.24;
                context.stroke();
            }
        }
    });
    return canvas;
}
