// Starts the page: texts, session, state, events; which view is shown is the address after '#'.
import { get } from "./api.js";
import * as control from "./control.js";
import { fill, h, setText } from "./dom.js";
import { clock, loadTexts, onLanguage, t } from "./i18n.js";
import { fetchSession, hasCode, pairByAddress, requireSession, startSession } from "./login.js";
import { mountMenu } from "./menu.js";
import { followState, refresh } from "./state.js";
import { store } from "./store.js";
import * as stream from "./stream.js";
import { errorWords, faultWord, saidWords, stateWord } from "./words.js";

import { view as captures } from "./view_captures.js";
import { view as people } from "./view_people.js";
import { view as plans } from "./view_plans.js";
import { view as preview } from "./view_preview.js";
import { view as rig } from "./view_rig.js";
import { view as sweep } from "./view_sweep.js";

// As they stand in the navigation. A view: {name, mount(root), unmount()}; its title is the text "nav.NAME".
const views = [rig, sweep, preview, captures, plans, people];

let shown = null;

function navigation() {
    fill(document.getElementById("nav-list"), views.map((view) =>
        h("li", {}, h("a", { href: `#${view.name}`, test: `nav-${view.name}`,
            "aria-current": view === shown ? "page" : null },
        h("span", { class: `icon icon-${view.name}`, "aria-hidden": "true" }), t(`nav.${view.name}`)))));
}

function leave() {
    const root = document.getElementById("view");

    try {
        shown?.unmount?.();
    } catch (error) {
        console.error(error);
    }
    root.replaceChildren();
    return root;
}

function enter(view) {
    const root = leave();

    shown = view;
    root.dataset.view = view.name;
    document.title = `${t(`nav.${view.name}`)} – Lumisphere`;
    navigation();
    try {
        view.mount(root);
    } catch (error) {
        // One view that fails leaves the others, the controls and the emergency stop as they are.
        console.error(error);
        fill(root, h("h1", {}, t(`nav.${view.name}`)), h("p", { class: "notice", data: { kind: "bad" } }, String(error)));
    }
}

function route({ focus = true } = {}) {
    const name = location.hash.slice(1).split("?")[0];
    const view = views.find((one) => one.name === name) ?? views[0];

    if (view === shown)
        return;
    enter(view);
    scrollTo(0, 0);
    if (focus)
        document.getElementById("main").focus({ preventScroll: true });
}

function showState() {
    const capture = store.get("capture");
    const state = document.getElementById("state");

    state.dataset.state = capture?.state ?? "unknown";
    setText(state, capture ? stateWord(capture.state) : t("state.unknown"));
    const text = document.getElementById("state-text");
    setText(text, saidWords(capture?.text));
    text.hidden = !capture?.text;
    setText(document.getElementById("rig-name"), store.get("profile")?.name || store.get("rig")?.board || t("rig"));
}

function showFaults() {
    const rig = store.get("rig");
    const element = document.getElementById("faults");
    const lines = [];

    if (store.get("estop"))
        lines.push(t("fault.pressed"));
    if (rig?.faults?.length)
        lines.push(t("fault.stand", { names: rig.faults.map(faultWord).join("; ") }));
    if (rig && rig.link !== "open")
        lines.push(t("fault.link", { text: rig.text || rig.link }));
    element.hidden = !lines.length;
    setText(element, lines.join(" "));
}

function showConnection() {
    const { state, since, why } = store.get("connection");
    const element = document.getElementById("connection");

    element.dataset.state = state;
    const lost = () => t("connection.lost", { time: clock(since) }) + (why ? ` (${why})` : "");
    setText(element, state === "lost" ? lost() : t(`connection.${state}`));
    document.body.classList.toggle("lost", state === "lost");
}

function shell() {
    showState();
    showFaults();
    showConnection();
    mountMenu(document.getElementById("menu"));
    control.mount(document.getElementById("control"));
}

async function start() {
    const texts = loadTexts();

    if (!hasCode())
        fetchSession().catch(() => {}); // meanwhile; what comes of it startSession looks at
    await texts;
    onLanguage(() => {
        shell();
        enter(shown);
    });
    store.on(["capture", "rig", "profile"], showState);
    store.on(["rig", "estop"], showFaults);
    store.on("connection", showConnection);
    // What sticks below the header wants to know how tall it is.
    new ResizeObserver(([entry]) => document.documentElement.style.setProperty("--header",
        `${Math.round(entry.borderBoxSize[0].blockSize)}px`)).observe(document.getElementById("header"));
    shell();
    followState();
    stream.on("open", () => {
        refresh();
        fetchSession().catch(() => {}); // who was here may not be any more
    });
    // A code in the address comes first: without it what the view asks for would be refused.
    if (!hasCode())
        route({ focus: false });
    await startSession();
    route({ focus: false });
    addEventListener("hashchange", async () => await pairByAddress() || route());
    await requireSession();
    stream.start();
    get("/api/v1/profile", { quiet: true }).then((profile) => store.set("profile", profile), () => {});
}

start().catch((error) => {
    console.error(error);
    document.getElementById("view").replaceChildren(errorWords(error));
});
