// The preflight: every check with its verdict, the reason and what to do; and the button that starts.
import { post } from "./api.js";
import { askMove, RESTING, whyNone } from "./control.js";
import { fill, h, newId, setText } from "./dom.js";
import { t } from "./i18n.js";
import { checkPlan, chosenPlan, loadPlans, planFacts, planSelect, problemList } from "./plan_list.js";
import { refresh } from "./state.js";
import { mayOperate, store } from "./store.js";
import { checkTitle, checkTodo, ICONS, noticeBox, stateWord } from "./words.js";

const ORDER = ["red", "undecided", "yellow", "green"];
// lumid overrides none of these (docs/capture-engine.md).
const FIRM = ["link", "versions", "profile", "plan", "drive"];

const overridden = new Set();
let parts = null;
let starting = false; // asked for here: when it turns, the sweep is what one wants to see
let seen = null; // the state at the last look
let unfollow = null;

const capture = () => store.get("capture");
const checksOf = (verdict) => store.get("checks").filter((one) => one.verdict === verdict);

function openReds() {
    return checksOf("red").filter((one) => FIRM.includes(one.name) || !overridden.has(one.name));
}

// Why it cannot be looked, or "".
function whyNoCheck() {
    if (whyNone())
        return whyNone();
    if (capture() && !RESTING.includes(capture().state))
        return capture().state === "preflight" ? t("why.checking") : t("why.busy", { state: stateWord(capture().state) });
    return chosenPlan() ? "" : t("why.noPlan");
}

function whyNoStart() {
    const why = whyNoCheck();
    const reds = openReds();

    if (why)
        return why;
    if (reds.length)
        return t("why.red", { n: reds.length, names: reds.map((one) => checkTitle(one.name)).join(", ") });
    if (store.get("checked") !== chosenPlan().text)
        return store.get("checked") === null ? t("why.unchecked") : t("why.otherPlan");
    if (!store.get("checks").length)
        return t("why.unchecked");
    return "";
}

function overrideBox(check) {
    const id = newId("override");

    if (check.verdict !== "red" || !mayOperate())
        return null;
    if (FIRM.includes(check.name))
        return h("p", { class: "why" }, t("rig.firm"));
    return h("label", { class: "choice", for: id },
        h("input", { id, type: "checkbox", test: "override", checked: overridden.has(check.name), on: { change: (event) => {
            if (event.target.checked)
                overridden.add(check.name);
            else
                overridden.delete(check.name);
            update();
        } } }), h("span", {}, t("rig.override")));
}

function checkItem(check) {
    const todo = checkTodo(check.name, check.verdict);

    return h("li", { class: "check", test: "check", data: { name: check.name, verdict: check.verdict } },
        h("span", { class: "verdict" }, h("span", { class: "mark", "aria-hidden": "true" }, ICONS[check.verdict] ?? "?"),
            h("span", {}, t(`verdict.${check.verdict}`))),
        h("div", { class: "what" }, h("h3", {}, checkTitle(check.name)),
            check.reason && h("p", {}, check.reason),
            todo && h("p", { class: "todo" }, h("strong", {}, t("rig.todo")), " ", todo),
            check.overridden && h("p", { class: "warn" }, t("rig.overridden")),
            overrideBox(check)));
}

function summary() {
    const checks = store.get("checks");
    const count = (verdict) => checks.filter((one) => one.verdict === verdict).length;

    if (capture()?.state === "preflight")
        return t("rig.checking", { n: checks.length });
    if (!checks.length)
        return t("rig.notYet");
    return t("rig.summary", { red: count("red"), yellow: count("yellow"), green: count("green") });
}

// The list is made again only where it differs, so that a tick box that has the focus keeps it.
function showChecks() {
    const checks = store.get("checks");
    const seen = JSON.stringify([checks, mayOperate()]);

    if (parts.list.dataset.seen === seen)
        return;
    parts.list.dataset.seen = seen;
    const focused = document.activeElement?.closest?.("[data-test=check]")?.dataset.name;
    const sorted = [...checks].sort((a, b) => ORDER.indexOf(a.verdict) - ORDER.indexOf(b.verdict));
    fill(parts.list, sorted.map(checkItem));
    if (focused)
        parts.list.querySelector(`[data-name="${CSS.escape(focused)}"] input`)?.focus();
}

function followStart() {
    const state = capture()?.state;

    if (starting && ["homing", "arming", "sweeping"].includes(state)) {
        starting = false;
        location.hash = "#sweep";
    } else if (starting && state === "red") {
        starting = false;
        parts.notice.say("bad", t("why.red", { n: openReds().length, names: openReds().map((one) => checkTitle(one.name)).join(", ") }));
    }
}

function update() {
    const noCheck = whyNoCheck();
    const noStart = whyNoStart();

    followStart();
    if (capture()?.state !== seen)
        parts.notice.age();
    seen = capture()?.state;
    showChecks();
    setText(parts.summary, summary());
    parts.run.disabled = noCheck !== "";
    parts.start.disabled = noStart !== "";
    setText(parts.why, noStart);
    parts.why.hidden = noStart === "";
}

// The figures of the chosen plan, from lumid.
async function showPlan() {
    const plan = chosenPlan();

    fill(parts.facts);
    if (!plan)
        return;
    try {
        const found = await checkPlan(plan.text);
        if (parts && plan === store.get("plan"))
            fill(parts.facts, problemList(found.problems), problemList(found.warnings, "warning"),
                found.runnable ? planFacts(found) : null);
    } catch (error) {
        if (parts && error.word !== "absent")
            parts.notice.error(error);
    }
}

async function run() {
    const plan = chosenPlan();

    parts.notice.clear();
    overridden.clear();
    store.set("checks", []);
    try {
        const answer = await post("/api/v1/capture/preflight", { plan: plan.text });
        store.set("checked", plan.text);
        store.set("checks", answer.checks ?? []);
    } catch (error) {
        parts?.notice.error(error);
    }
    refresh();
}

async function start() {
    const plan = chosenPlan();
    const names = checksOf("red").map((one) => one.name).filter((name) => overridden.has(name));
    const title = parts.title.value.trim();
    const content = h("div", {}, h("p", {}, t("rig.startPlan", { name: plan.name })),
        names.length > 0 && h("p", { class: "warn" }, t("rig.startOverridden", { names: names.map(checkTitle).join(", ") })));

    if (!await askMove(t("rig.startAsk"), content, t("rig.start")))
        return;
    try {
        await post("/api/v1/capture/start", { plan: plan.text, ...(title ? { title } : {}),
            ...(names.length ? { override: names } : {}) }, { moves: true });
        starting = true;
        parts?.notice.say("info", t("rig.started"));
    } catch (error) {
        parts?.notice.error(error, ...(error.word === "busy" ? [` ${t("move.busy")} `, h("a", { href: "#sweep" },
            t("rig.toSweep"))] : []));
    }
    refresh();
}

function chooser() {
    const change = () => {
        fill(parts.choose, planSelect(change));
        parts.notice.clear();
        overridden.clear();
        update();
        showPlan();
    };

    fill(parts.choose, planSelect(change));
}

export const view = {
    name: "rig",
    mount(root) {
        parts = {
            notice: noticeBox(),
            choose: h("div", {}),
            facts: h("div", { "aria-live": "polite" }),
            title: h("input", { test: "title", maxlength: 255, autocomplete: "off" }),
            run: h("button", { type: "button", test: "preflight-run", on: { click: run } }, t("rig.run")),
            start: h("button", { type: "button", class: "primary", test: "start", "aria-describedby": "start-why",
                on: { click: start } }, t("rig.start")),
            why: h("p", { id: "start-why", class: "why", test: "start-why" }),
            summary: h("p", { role: "status", test: "preflight-summary" }),
            list: h("ul", { class: "checks" }),
        };
        fill(root, h("h1", {}, t("rig.heading")),
            h("section", { class: "panel stack" },
                h("div", { class: "field" }, h("label", { for: "plan-select" }, t("rig.plan")), parts.choose),
                parts.facts,
                h("p", {}, h("a", { href: "#plans" }, t("rig.toPlans"))),
                h("label", { class: "field" }, h("span", {}, t("rig.title")), parts.title),
                h("div", { class: "row wrap" }, parts.run, parts.start), parts.why, parts.notice.element),
            h("section", { class: "stack" }, h("h2", {}, t("rig.checks")), parts.summary, parts.list));
        chooser();
        update();
        unfollow = store.on(["checks", "capture", "session", "connection", "checked"], update);
        loadPlans().catch((error) => parts?.notice.error(error)).then(() => {
            if (!parts)
                return;
            chooser();
            update();
            showPlan();
        });
    },
    unmount() {
        unfollow();
        parts = null;
    },
};
