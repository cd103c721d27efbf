// The sphere as a part of the page: a picture to be turned by finger, mouse and keys, the legend with counts, what is
// chosen, and the button that takes it again. sphere_table.js has the same without a picture.
import { CanvasSphere } from "./sphere_canvas.js";
import { h, newId, setText } from "./dom.js";
import { frames, onFrames, sphere } from "./frames.js";
import { GlSphere } from "./sphere_gl.js";
import { number, t } from "./i18n.js";
import { KINDS } from "./sphere.js";
import { colours, mark } from "./sphere_sprites.js";
import { retakeBar } from "./sphere_retake.js";
import { sphereTable } from "./sphere_table.js";
import { steer } from "./sphere_steer.js";
import { store } from "./store.js";

const RESTORE_MS = 3000; // a lost context that has not come back by then is not waited for
const MARGIN = 18;       // between the sphere and the picture's edge, CSS pixels

function wantsCanvas() {
    return new URLSearchParams(location.search).has("canvas");
}

// What draws, on a canvas of its own: one that has had a WebGL context can have no other.
class Stage {
    constructor(changed) {
        this.changed = changed;
        this.element = h("div", { class: "sphere-stage" });
        this.hint = newId("sphere-hint");
        this.arm = [];
        this.observer = new ResizeObserver(() => this.resize());
        this.observer.observe(this.element);
        this.make(!wantsCanvas());
    }

    make(gl) {
        this.renderer?.destroy();
        this.canvas = h("canvas", { class: "sphere-canvas", tabindex: "0", role: "application", "aria-label": t("sphere.label"),
            "aria-describedby": this.hint });
        this.renderer = null;
        this.why = wantsCanvas() ? "asked" : gl ? "" : "lost";
        try {
            this.renderer = gl ? GlSphere.create(this.canvas, (lost) => this.onLost(lost)) : null;
        } catch (error) {
            console.error(error);
            this.canvas = this.canvas.cloneNode();
        }
        if (!this.renderer) {
            this.why ||= "missing";
            this.renderer = CanvasSphere.create(this.canvas);
        }
        this.element.querySelector("canvas")?.remove();
        this.element.prepend(this.canvas);
        this.unsteer?.();
        this.unsteer = steer(this);
        this.recolour();
        this.renderer.setFrames(sphere);
        this.resize();
    }

    onLost(lost) {
        clearTimeout(this.lostTimer);
        if (lost)
            this.lostTimer = setTimeout(() => {
                this.make(false);
                this.changed();
            }, RESTORE_MS);
        else
            this.refresh();
    }

    recolour() {
        this.renderer.setColours(colours(document.documentElement));
        this.redraw();
    }

    reload() {
        this.renderer.setFrames(sphere);
        this.refresh();
    }

    refresh() {
        const capture = store.get("capture");
        const moving = capture && !["idle", "done", "failed", "red", "sealing"].includes(capture.state);

        this.stale = true;
        this.arm = capture?.arm || (moving && frames.lastShot >= 0)
            ? sphere.arm(capture.arm, frames.lastShot >= 0 ? frames.lastShot : (capture.fired ?? 1) - 1) : [];
        this.redraw();
    }

    resize() {
        const scale = Math.min(2, devicePixelRatio || 1);
        const width = this.element.clientWidth, height = this.element.clientHeight;

        this.canvas.width = Math.max(1, Math.round(width * scale));
        this.canvas.height = Math.max(1, Math.round(height * scale));
        this.scale = scale;
        this.redraw();
    }

    // Of the sphere, in CSS pixels.
    radius() {
        return Math.max(20, Math.min(this.element.clientWidth, this.element.clientHeight) / 2 - MARGIN) * sphere.zoom;
    }

    markSize() {
        const fair = this.radius() * Math.sqrt(4 * Math.PI / Math.max(1, sphere.count)) * 0.8;

        return Math.min(20, Math.max(6, fair));
    }

    redraw() {
        if (!this.due)
            this.due = requestAnimationFrame(() => {
                this.due = 0;
                if (this.stale)
                    this.renderer.update(this.arm);
                this.stale = false;
                this.renderer.draw({ matrix: sphere.matrix(), radius: this.radius() * this.scale, size: this.markSize() * this.scale });
            });
    }

    // From CSS pixels of the canvas to the sphere's units.
    toSphere(x, y) {
        const radius = this.radius();

        return [(x - this.element.clientWidth / 2) / radius, (y - this.element.clientHeight / 2) / radius];
    }

    destroy() {
        clearTimeout(this.lostTimer);
        cancelAnimationFrame(this.due);
        this.observer.disconnect();
        this.unsteer();
        this.renderer.destroy();
    }
}

function legend() {
    const counts = KINDS.map(() => h("span", { class: "legend-count" }));
    const element = h("ul", { class: "sphere-legend", test: "sphere-legend", "aria-label": t("sphere.legend") },
        KINDS.map((kind, i) => h("li", { data: { kind: kind.name } }, mark(kind.name),
            h("span", {}, t(`kind.${kind.name}`)), counts[i])),
        h("li", { data: { kind: "arm" } }, mark("arm"), h("span", {}, t("kind.arm"))));

    return {
        element,
        update() {
            KINDS.forEach((kind, i) => {
                setText(counts[i], number(sphere.counts[i]));
                counts[i].parentElement.classList.toggle("none", sphere.counts[i] === 0);
            });
        },
    };
}

function tools(stage, choosing) {
    const frame = h("button", { type: "button", class: "tool", "aria-pressed": "false", test: "choose-frame",
        on: { click: () => {
            choosing.on = !choosing.on;
            frame.setAttribute("aria-pressed", String(choosing.on));
            stage.element.classList.toggle("choosing", choosing.on);
        } } }, t("sphere.chooseFrame"));
    const arm = h("button", { type: "button", class: "tool", on: { click: () => {
        if (stage.arm.length)
            sphere.lookAt(stage.arm[Math.floor(stage.arm.length / 2)]);
        stage.redraw();
    } } }, t("sphere.showArm"));
    const whole = h("button", { type: "button", class: "tool", on: { click: () => {
        sphere.zoom = 1;
        sphere.tilt = 0.35;
        stage.redraw();
    } } }, t("sphere.whole"));

    return h("div", { class: "row wrap sphere-tools", role: "group", "aria-label": t("sphere.tools") }, frame, arm, whole);
}

function note(stage) {
    if (frames.state === "asking")
        return t("sphere.asking");
    if (frames.state === "none")
        return t("sphere.none");
    if (frames.state === "absent")
        return t("sphere.absent");
    if (frames.state === "failed")
        return t("sphere.failed", { detail: frames.error?.detail ?? "" });
    return stage.renderer.mode === "canvas" ? t(`sphere.canvas.${stage.why}`) : "";
}

// {element, words, destroy}; `words`: the same without a picture.
export function sphereView() {
    const choosing = { on: false };
    let root = null;
    const said = h("p", { class: "sphere-note", role: "status" });
    const stage = new Stage(() => show("frames"));
    const key = legend(), retake = retakeBar(() => show("chosen")), table = sphereTable(() => show("chosen"));

    const show = (what) => {
        if (what === "frames")
            stage.reload();
        else if (what !== "reasons")
            stage.refresh();
        key.update();
        retake.update();
        table.update(what);
        Object.assign(root.dataset, { mode: stage.renderer.mode, good: sphere.sum("good"), bad: sphere.sum("bad"),
            planned: sphere.counts[0], frames: sphere.count, chosen: sphere.chosen.size, state: frames.state });
        setText(said, note(stage));
    };
    stage.choosing = choosing;
    stage.chose = () => show("chosen");
    root = h("section", { class: "sphere", test: "sphere", "aria-label": t("sphere.title") },
        stage.element, h("p", { class: "hint", id: stage.hint }, t("sphere.hint")), tools(stage, choosing), said, key.element,
        retake.element);
    const theme = new MutationObserver(() => stage.recolour());
    theme.observe(document.documentElement, { attributes: true });
    const bright = matchMedia("(prefers-color-scheme: light)"), recolour = () => stage.recolour();
    bright.addEventListener("change", recolour);
    const off = onFrames(show);
    show("frames");
    return { element: root, words: table.element, destroy() {
        off();
        theme.disconnect();
        bright.removeEventListener("change", recolour);
        stage.destroy();
    } };
}

