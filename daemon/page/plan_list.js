// Plans to choose from: those lumid has to begin with, and those kept in this browser.
import { get, post } from "./api.js";
import { h } from "./dom.js";
import { bytes, duration, has, number, t } from "./i18n.js";
import { kept, store } from "./store.js";
import { planName } from "./plan_text.js";

let offered = null; // [{name, title, text}]

export function ownPlans() {
    return kept.get("plans", []).filter((one) => typeof one?.name === "string" && typeof one?.text === "string");
}

export function saveOwnPlan(name, text) {
    return kept.set("plans", [...ownPlans().filter((one) => one.name !== name), { name, text }]);
}

export function removeOwnPlan(name) {
    return kept.set("plans", ownPlans().filter((one) => one.name !== name));
}

export async function loadPlans() {
    if (!offered) {
        const answer = await get("/api/v1/plans");
        offered = answer.plans;
    }
    return offered;
}

// In the page's language, where it is one that every lumid knows.
function titleOf(plan) {
    const title = has(`planTitle.${plan.name}`) ? t(`planTitle.${plan.name}`) : plan.title;

    return title ? `${plan.name} – ${title}` : plan.name;
}

// [{key, name, text}] under the two headings, and what was edited but is in neither.
function groups() {
    return [
        [t("plans.offered"), (offered ?? []).map((one) => ({ key: `rig:${one.name}`, title: titleOf(one), name: one.name,
            text: one.text }))],
        [t("plans.own"), ownPlans().map((one) => ({ key: `own:${one.name}`, title: one.name, name: one.name, text: one.text }))],
    ];
}

export function findPlan(key) {
    return groups().flatMap(([, plans]) => plans).find((one) => one.key === key) ?? null;
}

// The chosen plan: {key, name, text}; the first of lumid's where nothing is chosen yet.
export function chosenPlan() {
    if (!store.get("plan")) {
        const first = kept.get("plan", null) ?? groups().flatMap(([, plans]) => plans)[0] ?? null;
        if (first)
            store.set("plan", { key: first.key, name: first.name, text: first.text });
    }
    return store.get("plan");
}

export function choosePlan(plan) {
    kept.set("plan", plan);
    store.set("plan", plan);
}

// A select of all plans; what was changed by hand is shown as such.
export function planSelect(change) {
    const chosen = chosenPlan();
    const known = chosen && findPlan(chosen.key);
    const edited = chosen && known?.text !== chosen.text;
    const select = h("select", { id: "plan-select", test: "plan-select", value: edited ? "edited" : chosen?.key ?? "", on: {
        change: () => {
            const plan = findPlan(select.value);
            if (plan) {
                choosePlan({ key: plan.key, name: plan.name, text: plan.text });
                change();
            }
        } } },
    !chosen && h("option", { value: "" }, t("plans.none")),
    edited && h("option", { value: "edited" }, t("plans.edited", { name: planName(chosen.text) || chosen.name })),
    groups().filter(([, plans]) => plans.length).map(([label, plans]) => h("optgroup", { label },
        plans.map((plan) => h("option", { value: plan.key }, plan.title)))));

    return select;
}

export function checkPlan(text) {
    return post("/api/v1/plans/check", { plan: text });
}

// What a plan comes to, as a list of facts.
export function planFacts(found) {
    const row = (key, value) => (value === null || value === undefined ? null
        : h("div", {}, h("dt", {}, t(key)), h("dd", { test: key.replace(".", "-") }, value)));
    const metres = (value) => (value === null || value === undefined ? null : t("metres", { value: number(value, 2) }));

    return h("dl", { class: "facts", test: "plan-facts" },
        row("plan.time", duration(found.seconds)),
        row("plan.grid", found.rows && found.columns ? t("plan.gridOf", { rows: found.rows, columns: found.columns }) : null),
        row("plan.shots", number(found.shots)),
        row("plan.frames", number(found.frames)),
        row("plan.bytes", bytes(found.bytes)),
        row("plan.blur", found.blur_px === null || found.blur_px === undefined ? null
            : t("pixels", { value: number(found.blur_px, 2) })),
        row("plan.volume", metres(found.view_volume_m)),
        row("plan.nearest", metres(found.nearest_sharp_m)));
}

// `kind`: "problem", or "warning", with which it can be run all the same.
export function problemList(problems, kind = "problem") {
    return h("ul", { class: "problems", data: { kind } }, (problems ?? []).map((problem) => h("li", { test: `plan-${kind}`,
        data: { line: problem.line ?? "" } }, problem.line ? t("plan.line", { line: String(problem.line), text: problem.text })
        : problem.text ?? problem)));
}
