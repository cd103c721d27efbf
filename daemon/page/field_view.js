// The light field so far, seen from inside the sphere: a picture that follows the finger. At most one is asked for at a time,
// and the newest wish wins; while a finger moves it is a small one, and what is there already is shifted along with it.
//
// Metres from the sphere's centre, radians; yaw 0 looks along +X, a quarter turn along +Y; +Z up (docs/rendering.md).
import { get } from "./api.js";
import { h, setText } from "./dom.js";
import { number, t } from "./i18n.js";
import { steerField } from "./field_steer.js";
import { store } from "./store.js";
import * as stream from "./stream.js";
import { errorWords } from "./words.js";

const FOV = 75 * Math.PI / 180; // across the width
const ASPECT = 3 / 2;
const SMALL = 240;         // pixels across while something moves
const LARGE = 720;         // at most, at rest
const REST_MS = 250;
const LOOK_MS = 5000;
const NEWS_MS = 1000;      // a picture is asked for anew at most so often because more frames came in
const PITCH_MOST = 85 * Math.PI / 180;
const REACH = 0.7;         // of the sphere's radius: further out there is nothing to be seen from

export class FieldView {
    constructor() {
        this.pose = { x: 0, y: 0, z: 0, yaw: 0, pitch: 0 };
        this.shown = null; // the picture, and the pose it was made for
        this.under = false;
        this.viewer = `page${Math.random().toString(36).slice(2)}`;
        this.made = 0;
        this.said = h("p", { class: "field-said", role: "status" });
        this.hint = h("p", { class: "hint", id: "field-hint" }, t("field.hint"));
        this.canvas = h("canvas", { class: "field-canvas", tabindex: "0", role: "application", "aria-label": t("field.label"),
            "aria-describedby": "field-hint", width: String(LARGE), height: String(LARGE / ASPECT) });
        this.none = h("p", { class: "no-picture" }, t("field.asking"));
        this.place = h("p", { class: "hint field-place" });
        this.stage = h("div", { class: "field-stage" }, this.none, this.canvas);
        this.element = h("section", { class: "field-part", test: "field-view", data: { frames: "0", rows: "0", state: "none" },
            "aria-labelledby": "field-title" }, h("h2", { id: "field-title" }, t("field.title")), this.said, this.stage, this.hint,
        this.tools(), this.place);
        this.begin();
    }

    tools() {
        const button = (name, call) => h("button", { type: "button", class: "tool", test: `field-${name}`, "aria-label": t(`field.${name}`),
            title: t(`field.${name}`), on: { click: call } }, t(`field.${name}.sign`));
        const step = this.radius() / 8;

        return h("div", { class: "row wrap", role: "group", "aria-label": t("field.move") },
            button("left", () => this.move(-step, 0, 0)), button("right", () => this.move(step, 0, 0)),
            button("forward", () => this.move(0, 0, step)), button("back", () => this.move(0, 0, -step)),
            button("up", () => this.move(0, step, 0)), button("down", () => this.move(0, -step, 0)),
            h("button", { type: "button", test: "field-home", on: { click: () => {
                this.pose = { x: 0, y: 0, z: 0, yaw: 0, pitch: 0 };
                this.changed();
            } } }, t("field.home")));
    }

    begin() {
        this.stop = new AbortController();
        this.unsteer = steerField(this);
        this.seen = new IntersectionObserver(([entry]) => {
            this.visible = entry.isIntersecting;
            this.ask();
        });
        this.seen.observe(this.stage);
        this.sizes = new ResizeObserver(() => this.changed());
        this.sizes.observe(this.stage);
        this.offs = [stream.on("field", (data) => this.news(data)), stream.on("open", () => this.look())];
        document.addEventListener("visibilitychange", () => this.ask(), { signal: this.stop.signal });
        this.look();
    }

    radius() {
        return store.get("profile")?.radius_m || 0.35;
    }

    // ---- what the finger wants ----

    turn(byYaw, byPitch) {
        this.pose.yaw += byYaw;
        this.pose.pitch = Math.min(PITCH_MOST, Math.max(-PITCH_MOST, this.pose.pitch + byPitch));
        this.changed();
    }

    // To the right, up, forward as one looks, metres.
    move(right, up, forward) {
        const { yaw, pitch } = this.pose, cp = Math.cos(pitch), sp = Math.sin(pitch), cy = Math.cos(yaw), sy = Math.sin(yaw);
        const p = this.pose, most = REACH * this.radius();

        p.x += right * sy - up * sp * cy + forward * cp * cy;
        p.y += -right * cy - up * sp * sy + forward * cp * sy;
        p.z += up * cp + forward * sp;
        const far = Math.hypot(p.x, p.y, p.z);
        if (far > most) {
            p.x *= most / far;
            p.y *= most / far;
            p.z *= most / far;
        }
        this.changed();
    }

    changed() {
        this.moving = true;
        clearTimeout(this.rest);
        this.rest = setTimeout(() => {
            this.moving = false;
            this.stale = true;
            this.ask();
        }, REST_MS);
        this.stale = true;
        this.draw();
        this.ask();
        const { x, y, z } = this.pose, far = Math.hypot(x, y, z);
        setText(this.place, t(far < 1e-3 ? "field.centre" : "field.away", { cm: number(far * 100, 1) }));
    }

    // ---- pictures ----

    ask() {
        if (!this.stale || this.under || !this.visible || document.hidden || this.lookTimer || !this.some() || this.stop.signal.aborted)
            return;
        this.stale = false;
        this.under = true;
        this.fetchView({ ...this.pose }, this.moving).catch((error) => this.failed(error)).then(() => {
            this.under = false;
            this.ask();
        });
    }

    async fetchView(pose, small) {
        const scale = Math.min(2, devicePixelRatio || 1);
        const width = small ? SMALL : Math.max(SMALL, Math.min(LARGE, 16 * Math.round(this.stage.clientWidth * scale / 16)));
        const query = new URLSearchParams({ viewer: this.viewer, fov: FOV.toFixed(5), width: String(width), height: String(Math.round(width / ASPECT)) });

        for (const name of ["x", "y", "z", "yaw", "pitch"])
            query.set(name, pose[name].toFixed(5));
        const answer = await get(`/api/v1/field/view.jpg?${query}`, { raw: true, quiet: true, patience: 20000 });
        const bitmap = await createImageBitmap(await answer.blob());
        this.shown?.bitmap.close();
        this.shown = { bitmap, pose };
        this.none.hidden = true;
        this.tell({ frames: Number(answer.headers.get("X-Lumid-Frames")) });
        this.element.dataset.state = "there";
        this.element.dataset.pictures = String(++this.made);
        this.draw();
    }

    failed(error) {
        const early = error.word === "busy" || error.word === "cancelled";

        if (this.stop.signal.aborted || error.word === "stopped")
            return;
        if (this.shown && !early)
            setText(this.said, errorWords(error));
        else if (!this.shown && early)
            this.nothing("none", error.detail ? t("field.why", { detail: error.detail }) : t("field.none"));
        else if (!this.shown)
            this.nothing(error.word === "absent" ? "absent" : "failed", error.word === "absent" ? t("field.absent") : errorWords(error));
        this.lookLater();
    }

    nothing(state, words) {
        this.none.hidden = false;
        this.element.dataset.state = state;
        setText(this.none, words);
    }

    // The picture there is, shifted to where one looks by now: until the right one comes.
    draw() {
        const context = this.canvas.getContext("2d"), { width, height } = this.canvas;

        if (!this.shown)
            return;
        const { bitmap, pose } = this.shown, focal = width / 2 / Math.tan(FOV / 2);
        const dx = focal * Math.tan(clamp(this.pose.yaw - pose.yaw)), dy = focal * Math.tan(clamp(this.pose.pitch - pose.pitch));
        context.clearRect(0, 0, width, height);
        context.drawImage(bitmap, dx, dy, width, height);
    }

    // ---- how much there is ----

    // The program that draws starts with the first question, and knows only then how much there is.
    some() {
        const capture = store.get("capture");

        return this.frames() > 0 || (capture?.stored ?? 0) + (capture?.accepted ?? 0) > 0;
    }

    frames() {
        return Number(this.element.dataset.frames);
    }

    tell(data) {
        if (Number.isFinite(data.frames))
            this.element.dataset.frames = String(data.frames);
        if (Number.isFinite(data.rows))
            this.element.dataset.rows = String(data.rows);
        setText(this.said, this.frames() ? t("field.made", { n: this.frames(), rows: t("field.rows", { n: Number(this.element.dataset.rows) }) })
            : t("field.nothing"));
        if (!this.some()) { // nothing yet, or another capture has begun
            this.shown = null;
            this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
            this.nothing("none", t("field.none"));
        }
    }

    news(data) {
        clearTimeout(this.lookTimer);
        this.lookTimer = 0;
        this.tell(data);
        this.newsTimer ||= setTimeout(() => {
            this.newsTimer = 0;
            this.stale = true;
            this.ask();
        }, this.shown ? NEWS_MS : 0);
    }

    async look() {
        clearTimeout(this.lookTimer);
        this.lookTimer = 0;
        try {
            this.tell(await get("/api/v1/field", { quiet: true }));
        } catch (error) {
            this.failed(error);
            return;
        }
        this.stale = true;
        this.ask();
        if (!this.some())
            this.lookLater();
    }

    // Whoever was refused does not ask with every move of a finger.

    lookLater() {
        clearTimeout(this.lookTimer);
        if (!this.stop.signal.aborted)
            this.lookTimer = setTimeout(() => (this.visible && !document.hidden ? this.look() : this.lookLater()), LOOK_MS);
    }

    destroy() {
        this.stop.abort();
        this.unsteer();
        this.seen.disconnect();
        this.sizes.disconnect();
        this.offs.forEach((off) => off());
        clearTimeout(this.rest);
        clearTimeout(this.newsTimer);
        clearTimeout(this.lookTimer);
        this.shown?.bitmap.close();
        this.shown = null;
    }
}

function clamp(angle) {
    return Math.min(1.2, Math.max(-1.2, angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI))));
}
