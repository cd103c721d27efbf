// The bar of controls: what can be done in this state by who is logged in, and for the rest why not. What moves the rig
// asks once, and shows who else is connected.
import { post } from "./api.js";
import * as dialog from "./dialog.js";
import { fill, h, setText } from "./dom.js";
import { bytes, duration, number, t } from "./i18n.js";
import { peopleNow } from "./people.js";
import { mayOperate, store } from "./store.js";
import { refresh } from "./state.js";
import { noticeBox, saidWords, stateWord } from "./words.js";

export const RESTING = ["idle", "red", "done", "failed"];
const WAITING = ["paused", "interrupted"];
const TAKING = ["homing", "arming", "sweeping"];

// Where the button may be pressed; `moves`: asks before, and is not sent again by itself after a new login.
const actions = [
    { name: "pause", in: TAKING, call: pause },
    { name: "resume", in: [...WAITING, "draining"], moves: true, call: resume },
    { name: "stop", in: [...TAKING, ...WAITING, "preflight", "pausing", "draining"], call: stop },
    { name: "retake", in: RESTING, moves: true, call: retake },
    { name: "home", in: [...RESTING, ...WAITING], moves: true, call: home },
    { name: "jog", in: [...RESTING, ...WAITING], moves: true, call: jog },
    { name: "clear", in: null, call: clear },
];
const LATER_MS = 800; // what the board makes of it is known a little later
const QUICK = ["pause", "resume"];

let unfollow = null;
let notice = null;

function state() {
    return store.get("capture")?.state ?? "unknown";
}

// Why nothing at all, or "".
export function whyNone() {
    if (store.get("connection").state !== "open")
        return t("why.connection");
    if (!store.get("session")?.you)
        return t("why.session");
    return mayOperate() ? "" : t("why.watch");
}

// Why not this, or "".
export function whyNot(action) {
    const all = whyNone();

    if (all)
        return all;
    if (action.in && !action.in.includes(state()))
        return t(`why.${action.name}`, { state: stateWord(state()) });
    if (action.name === "clear" && !store.get("rig")?.faults?.length && !store.get("estop") && state() !== "interrupted")
        return t("why.clear");
    return "";
}

async function send(name, body, options) {
    notice.say("info", t("sending"));
    try {
        const capture = await post(`/api/v1/capture/${name}`, body, options);
        notice.say("good", t(`control.${name}.sent`));
        if (capture?.state)
            store.set("capture", { ...store.get("capture"), ...capture });
        refresh();
        setTimeout(refresh, LATER_MS);
        return true;
    } catch (error) {
        notice.error(error, error.word === "busy" ? ` ${t("move.busy")}` : "");
        refresh();
        return false;
    }
}

// Asks for what moves the rig.
export function askMove(title, content, confirm) {
    return dialog.ask(title, [h("p", { class: "warn" }, t("move.warning")), content, peopleNow()], { confirm });
}

function pause() {
    return send("pause", {});
}

async function resume() {
    if (await askMove(t("control.resume.ask"), h("p", {}, saidWords(store.get("capture")?.text)), t("control.resume")))
        await send("resume", {}, { moves: true });
}

function choice(name, options) {
    return h("fieldset", {}, h("legend", {}, t(`control.${name}`)), options.map(([value, key], i) =>
        h("label", { class: "choice" }, h("input", { type: "radio", name, value, checked: i === 0, test: `${name}-${value}` }),
            h("span", {}, t(key)))));
}

const chosen = (root, name) => root.querySelector(`input[name="${name}"]:checked`)?.value;

async function stop() {
    const content = h("div", { class: "stack" }, choice("when", [["safe", "control.when.safe"], ["now", "control.when.now"]]),
        choice("then", [["seal", "control.then.seal"], ["keep", "control.then.keep"]]), peopleNow());

    if (await dialog.ask(t("control.stop.ask"), content, { confirm: t("control.stop") }))
        await send("stop", { at_once: chosen(content, "when") === "now", seal: chosen(content, "then") === "seal" });
}

async function retake() {
    const missing = (store.get("capture")?.missing ?? 0) + (store.get("capture")?.rejected ?? 0);

    if (await askMove(t("control.retake.ask"), h("p", {}, store.get("capture")?.path
        ? t("control.retake.what", { n: missing }) : t("control.retake.youngest")), t("control.retake")))
        await send("retake", {}, { moves: true });
}

async function home() {
    const turn = h("input", { type: "number", min: 0, max: 10000, step: 1, value: "0", test: "home-turn",
        inputmode: "numeric" });
    const content = h("div", { class: "stack" }, choice("how", [["turn", "control.how.turn"], ["wind", "control.how.wind"]]),
        h("label", { class: "field" }, h("span", {}, t("control.turn")), turn));

    content.addEventListener("change", () => {
        turn.disabled = chosen(content, "how") === "wind";
    });
    if (!await askMove(t("control.home.ask"), content, t("control.home")))
        return;
    const body = chosen(content, "how") === "wind" ? { wind_up: true } : { turn: Math.trunc(Number(turn.value)) || 0 };
    await send("home", body, { moves: true });
}

async function jog() {
    const degrees = h("input", { type: "number", min: -360, max: 360, step: "any", value: "10", required: true,
        test: "jog-degrees", inputmode: "decimal" });
    const content = h("div", { class: "stack" }, h("label", { class: "field" }, h("span", {}, t("control.degrees")), degrees),
        h("div", { class: "row wrap" }, [-90, -10, -1, 1, 10, 90].map((by) => h("button", { type: "button",
            class: "small", on: { click: () => {
                degrees.value = by;
            } } }, `${by > 0 ? "+" : "−"}${Math.abs(by)}°`))));

    if (await askMove(t("control.jog.ask"), content, t("control.jog")))
        await send("jog", { degrees: Number(degrees.value) }, { moves: true });
}

function clear() {
    return send("clear", {});
}

function button(action, idPrefix) {
    const why = h("small", { id: `${idPrefix}-${action.name}-why` });
    const element = h("button", { type: "button", class: `act act-${action.name}`, test: idPrefix === "act" ? action.name
        : `${idPrefix}-${action.name}`, "aria-describedby": why.id, on: { click: () => action.call() } },
    h("span", { class: `icon icon-${action.name}`, "aria-hidden": "true" }), h("span", {}, t(`control.${action.name}`)), why);

    return { element, action, update(quick) {
        const reason = whyNot(action);

        element.disabled = reason !== "";
        element.hidden = quick && reason !== "";
        setText(why, quick || reason === whyNone() ? "" : reason); // what is so for all is said once
    } };
}

function facts(element) {
    const capture = store.get("capture");
    const disk = store.get("disk");
    const rows = [];
    const row = (key, value, test) => rows.push(h("div", {}, h("dt", {}, t(key)), h("dd", { test }, value)));

    if (capture?.frames) {
        row("fact.stored", t("fact.of", { a: capture.stored + capture.accepted + capture.rejected, b: capture.frames }), "fact-stored");
        row("fact.good", number(capture.accepted), "fact-good");
        row("fact.bad", number(capture.rejected + capture.missing), "fact-bad");
        if (capture.seconds_left !== null && !RESTING.includes(capture.state))
            row("fact.left", duration(capture.seconds_left), "fact-left");
    }
    if (capture?.disk_seconds_left)
        row("fact.diskTime", duration(capture.disk_seconds_left), "fact-disk-time");
    row("fact.disk", bytes(capture?.disk_free_bytes ?? disk?.disk_free_bytes), "fact-disk");
    if (capture && !RESTING.includes(capture.state))
        row("fact.rate", t("perSecond", { what: bytes(capture.bytes_per_second ?? disk?.bytes_per_second) }), "fact-rate");
    fill(element, rows);
}

function progress(bar, capture) {
    const whole = capture?.frames ?? 0;
    const there = whole ? (capture.stored + capture.accepted) / whole : 0;

    bar.hidden = !whole || capture.state === "idle";
    bar.value = there;
    bar.setAttribute("aria-valuetext", t("fact.percent", { n: Math.floor(there * 100) }));
}

export function mount(root) {
    const buttons = actions.map((action) => button(action, "act"));
    const quick = actions.filter((one) => QUICK.includes(one.name)).map((action) => button(action, "quick"));
    const bar = h("progress", { max: 1, "aria-label": t("fact.progress"), test: "progress" });
    const numbers = h("dl", { class: "facts" });
    const none = h("p", { class: "why", test: "control-why" });
    const more = h("button", { type: "button", class: "more", test: "control-more", "aria-expanded": "false",
        "aria-controls": "control-panel", on: { click: () => {
            more.setAttribute("aria-expanded", String(root.classList.toggle("open")));
        } } }, t("control.more"));
    let seen = state();
    const update = () => {
        const capture = store.get("capture");

        if (state() !== seen)
            notice.age();
        seen = state();
        setText(none, whyNone());
        none.hidden = whyNone() === "";
        buttons.forEach((one) => one.update(false));
        quick.forEach((one) => one.update(true));
        progress(bar, capture);
        facts(numbers);
    };

    const fold = () => {
        root.classList.remove("open");
        more.setAttribute("aria-expanded", "false");
    };

    unfollow?.();
    addEventListener("hashchange", fold);
    const unstore = store.on(["capture", "rig", "disk", "estop", "session", "connection"], update);
    unfollow = () => {
        removeEventListener("hashchange", fold);
        unstore();
    };
    notice = noticeBox();
    fill(root, h("div", { class: "quick" }, quick.map((one) => one.element), more),
        h("div", { id: "control-panel", class: "stack" }, h("h2", {}, t("control")), bar, numbers, none, notice.element,
            h("div", { class: "acts" }, buttons.map((one) => one.element))));
    update();
}
