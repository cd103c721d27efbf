// Fingers, mouse and keys on the sphere's picture. One finger turns it, two enlarge it; a tap chooses a frame; a drag with
// Shift, or while "choose by a frame" is pressed, draws one around what is chosen. Nothing goes on moving by itself.
import { sphere } from "./frames.js";
import { h } from "./dom.js";

const TAP_PX = 8;
const REACH_PX = 24;
const KEY_RAD = Math.PI / 24;

const KEYS = {
    ArrowLeft: () => sphere.turn(-KEY_RAD, 0),
    ArrowRight: () => sphere.turn(KEY_RAD, 0),
    ArrowUp: () => sphere.turn(0, KEY_RAD),
    ArrowDown: () => sphere.turn(0, -KEY_RAD),
    "+": () => sphere.enlarge(1.2),
    "=": () => sphere.enlarge(1.2),
    "-": () => sphere.enlarge(1 / 1.2),
    Home: () => {
        sphere.zoom = 1;
        sphere.tilt = 0.35;
    },
};

function onKey(stage, event) {
    const call = event.ctrlKey || event.altKey || event.metaKey ? null : KEYS[event.key];

    if (!call)
        return;
    event.preventDefault();
    call();
    stage.redraw();
}

// Where a pointer is on the picture, CSS pixels.
function at(stage, event) {
    const box = stage.canvas.getBoundingClientRect();

    return [event.clientX - box.left, event.clientY - box.top];
}

class Pointers {
    constructor(stage) {
        this.stage = stage;
        this.down = new Map(); // id → where it is
        this.box = h("div", { class: "rubber", hidden: true });
        stage.element.append(this.box);
    }

    start(event) {
        if (event.button)
            return;
        this.stage.canvas.setPointerCapture(event.pointerId);
        this.down.set(event.pointerId, at(this.stage, event));
        this.from = at(this.stage, event);
        this.moved = this.down.size > 1;
        this.drawing = this.down.size === 1 && (event.shiftKey || this.stage.choosing.on);
        this.leave = event.ctrlKey || event.metaKey || event.altKey;
    }

    move(event) {
        const before = this.down.get(event.pointerId), now = at(this.stage, event);

        if (!before)
            return;
        this.moved ||= Math.hypot(now[0] - this.from[0], now[1] - this.from[1]) > TAP_PX;
        if (this.down.size === 2)
            this.pinch(event.pointerId, before, now);
        else if (this.drawing)
            this.drawBox(now);
        else if (this.moved)
            sphere.turn((before[0] - now[0]) / this.stage.radius(), (now[1] - before[1]) / this.stage.radius());
        this.down.set(event.pointerId, now);
        this.stage.redraw();
    }

    pinch(id, before, now) {
        const other = [...this.down].find(([one]) => one !== id)[1];
        const was = Math.hypot(before[0] - other[0], before[1] - other[1]);

        this.moved = true;
        this.drawing = false;
        this.box.hidden = true;
        if (was > 10)
            sphere.enlarge(Math.hypot(now[0] - other[0], now[1] - other[1]) / was);
    }

    drawBox([x, y]) {
        const [x0, y0] = this.from;

        this.box.hidden = !this.moved;
        this.box.style.setProperty("left", `${Math.min(x, x0)}px`);
        this.box.style.setProperty("top", `${Math.min(y, y0)}px`);
        this.box.style.setProperty("width", `${Math.abs(x - x0)}px`);
        this.box.style.setProperty("height", `${Math.abs(y - y0)}px`);
    }

    end(event, given) {
        const now = this.down.get(event.pointerId);

        this.down.delete(event.pointerId);
        this.box.hidden = true;
        if (!now || !given || this.down.size)
            return;
        if (this.drawing && this.moved) {
            const [x0, y0] = this.stage.toSphere(...this.from), [x1, y1] = this.stage.toSphere(...now);
            sphere.choose(sphere.pickWithin(x0, y0, x1, y1), !this.leave);
        } else if (!this.moved) {
            const [x, y] = this.stage.toSphere(...now);
            const found = sphere.pick(x, y, REACH_PX / this.stage.radius());
            sphere.choose(found, !found.every((number) => sphere.chosen.has(number)));
        } else {
            return;
        }
        this.stage.chose();
    }
}

// Returns what ends it.
export function steer(stage) {
    const pointers = new Pointers(stage), stop = new AbortController(), { signal } = stop;
    const on = (name, call, options) => stage.canvas.addEventListener(name, call, { signal, ...options });

    on("keydown", (event) => onKey(stage, event));
    on("pointerdown", (event) => pointers.start(event));
    on("pointermove", (event) => pointers.move(event));
    on("pointerup", (event) => pointers.end(event, true));
    on("pointercancel", (event) => pointers.end(event, false));
    on("wheel", (event) => {
        if (!event.ctrlKey && document.activeElement !== stage.canvas)
            return; // whoever scrolls past goes on scrolling
        event.preventDefault();
        sphere.enlarge(Math.exp(-event.deltaY / 400));
        stage.redraw();
    }, { passive: false });
    return () => {
        stop.abort();
        pointers.box.remove();
    };
}
