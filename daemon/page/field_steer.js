// Fingers, mouse and keys in the light field: a drag looks around, as if one held the picture; two fingers, or Shift, move
// within the sphere; the wheel goes forward and back.
const KEY_RAD = Math.PI / 18;
const WHEEL_M = 0.0003;

function keys(view) {
    const step = view.radius() / 10;

    return {
        ArrowLeft: () => view.turn(KEY_RAD, 0), ArrowRight: () => view.turn(-KEY_RAD, 0),
        ArrowUp: () => view.turn(0, KEY_RAD), ArrowDown: () => view.turn(0, -KEY_RAD),
        a: () => view.move(-step, 0, 0), d: () => view.move(step, 0, 0), w: () => view.move(0, 0, step), s: () => view.move(0, 0, -step),
        e: () => view.move(0, step, 0), q: () => view.move(0, -step, 0),
        "Shift ArrowLeft": () => view.move(-step, 0, 0), "Shift ArrowRight": () => view.move(step, 0, 0),
        "Shift ArrowUp": () => view.move(0, 0, step), "Shift ArrowDown": () => view.move(0, 0, -step),
        PageUp: () => view.move(0, step, 0), PageDown: () => view.move(0, -step, 0),
    };
}

function onKey(view, event) {
    if (event.ctrlKey || event.altKey || event.metaKey)
        return;
    const name = event.key.startsWith("Arrow") ? event.key : event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const call = keys(view)[event.shiftKey && event.key.startsWith("Arrow") ? `Shift ${name}` : name];

    if (!call)
        return;
    event.preventDefault();
    call();
}

class Fingers {
    constructor(view) {
        this.view = view;
        this.down = new Map();
    }

    start(event) {
        if (event.button)
            return;
        this.view.canvas.setPointerCapture(event.pointerId);
        this.down.set(event.pointerId, [event.clientX, event.clientY]);
    }

    move(event) {
        const before = this.down.get(event.pointerId), now = [event.clientX, event.clientY];

        if (!before)
            return;
        const { clientWidth: width } = this.view.stage, dx = now[0] - before[0], dy = now[1] - before[1];
        const metres = 1.4 * this.view.radius() / width;
        if (this.down.size === 2)
            this.two(event.pointerId, before, now, metres);
        else if (event.shiftKey)
            this.view.move(-dx * metres, dy * metres, 0);
        else if (this.down.size === 1)
            this.view.turn(dx / width * 1.3, dy / width * 1.3);
        this.down.set(event.pointerId, now);
    }

    // Both together: sideways and up; apart: forward.
    two(id, before, now, metres) {
        const other = [...this.down].find(([one]) => one !== id)[1];
        const apart = Math.hypot(now[0] - other[0], now[1] - other[1]) - Math.hypot(before[0] - other[0], before[1] - other[1]);

        this.view.move(-(now[0] - before[0]) / 2 * metres, (now[1] - before[1]) / 2 * metres, apart * metres);
    }

    end(event) {
        this.down.delete(event.pointerId);
    }
}

// Returns what ends it.
export function steerField(view) {
    const fingers = new Fingers(view), stop = new AbortController(), { signal } = stop;
    const on = (name, call, options) => view.canvas.addEventListener(name, call, { signal, ...options });

    on("keydown", (event) => onKey(view, event));
    on("pointerdown", (event) => fingers.start(event));
    on("pointermove", (event) => fingers.move(event));
    on("pointerup", (event) => fingers.end(event));
    on("pointercancel", (event) => fingers.end(event));
    on("wheel", (event) => {
        if (document.activeElement !== view.canvas)
            return; // whoever scrolls past goes on scrolling
        event.preventDefault();
        view.move(0, 0, -event.deltaY * WHEEL_M);
    }, { passive: false });
    return () => stop.abort();
}
