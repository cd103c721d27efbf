// Plans: a form and the text it stands for, checked by lumid as one types, before anything turns.
import { h, fill, newId, setText } from "./dom.js";
import { t } from "./i18n.js";
import { checkPlan, choosePlan, chosenPlan, loadPlans, ownPlans, planFacts, planSelect, problemList, removeOwnPlan, saveOwnPlan } from "./plan_list.js";
import { planName, planValues, setPlanValue } from "./plan_text.js";
import { store } from "./store.js";
import { noticeBox } from "./words.js";

const TYPED_MS = 400;

// Keys of docs/rig-plan.md; `mode`: only in this one.
const FIELDS = [
    { key: "name", maxlength: 31 },
    { key: "mode", options: ["", "continuous", "start-stop", "video"] },
    { key: "turns", inputmode: "numeric" },
    { key: "first_turn", inputmode: "numeric" },
    { key: "positions", inputmode: "numeric" },
    { key: "turn_time_s", inputmode: "decimal" },
    { key: "position_time_s", inputmode: "decimal", mode: "start-stop" },
    { key: "settle_s", mode: "start-stop" },
    { key: "exposure_s" },
    { key: "stops", mode: "start-stop" },
    { key: "exposures_s" },
    { key: "bracket_gap_s", inputmode: "decimal", mode: "start-stop" },
    { key: "wind", options: ["", "plan", "full", "none"] },
    { key: "blur_max_px", inputmode: "decimal" },
    { key: "cameras" },
];

let parts = null;
let timer = null;
let number = 0; // of the last check that was asked for

function input(field) {
    const id = newId("plan");
    const help = h("small", { id: `${id}-help` }, t(`plan.${field.key}.help`));
    const attributes = { id, name: field.key, test: `plan-${field.key}`, "aria-describedby": help.id,
        on: { input: () => fromForm(field.key) } };
    const element = field.options
        ? h("select", attributes, field.options.map((one) => h("option", { value: one },
            one ? t(`plan.${field.key}.${one}`) : t("plan.default"))))
        : h("input", { ...attributes, inputmode: field.inputmode, maxlength: field.maxlength, autocomplete: "off",
            placeholder: t("plan.default"), spellcheck: "false" });

    return { field, element, row: h("div", { class: "field" }, h("label", { for: id }, t(`plan.${field.key}`)), element, help) };
}

function fromForm(key) {
    const { element } = parts.inputs.find((one) => one.field.key === key);

    parts.text.value = setPlanValue(parts.text.value, key, element.value.trim());
    changed();
    showModes();
}

function showModes() {
    const mode = planValues(parts.text.value).mode ?? "continuous";

    for (const { field, row, element } of parts.inputs)
        row.hidden = Boolean(field.mode) && field.mode !== mode && element.value === "";
}

function toForm() {
    const values = planValues(parts.text.value);

    for (const { field, element } of parts.inputs) {
        const value = values[field.key] ?? "";
        if (element.value !== value)
            element.value = value;
    }
    showModes();
}

function changed() {
    const text = parts.text.value;

    choosePlan({ key: store.get("plan")?.key ?? "", name: planName(text) || t("plans.unnamed"), text });
    choose();
    clearTimeout(timer);
    timer = setTimeout(check, TYPED_MS);
}

// The lines with problems are marked beside the text, and told below it.
function showLines(problems) {
    const count = parts.text.value.split("\n").length;
    const bad = new Map(problems.filter((one) => one.line).map((one) => [one.line, one.text]));

    fill(parts.lines, Array.from({ length: count }, (_, i) => h("span", { class: bad.has(i + 1) ? "bad" : null,
        title: bad.get(i + 1) }, bad.has(i + 1) ? `✖ ${i + 1}` : String(i + 1))));
    parts.lines.scrollTop = parts.text.scrollTop;
    parts.text.setAttribute("aria-invalid", String(problems.length > 0));
}

function showFound(found) {
    parts.said.dataset.runnable = String(found.runnable);
    setText(parts.verdict, found.runnable ? t("plan.runnable") : t("plan.notRunnable"));
    parts.verdict.dataset.kind = found.runnable ? "good" : "bad";
    fill(parts.found, problemList(found.problems), problemList(found.warnings, "warning"), found.shots || found.seconds ? planFacts(found) : null);
    showLines(found.problems ?? []);
}

async function check() {
    const mine = ++number;

    try {
        const found = await checkPlan(parts.text.value);
        if (parts && mine === number) {
            parts.verdict.hidden = false;
            showFound(found);
        }
    } catch (error) {
        if (!parts || mine !== number)
            return;
        parts.verdict.hidden = true;
        fill(parts.found);
        parts.notice.error(error);
    }
}

function choose() {
    const take = () => {
        parts.text.value = chosenPlan()?.text ?? "";
        parts.notice.clear();
        toForm();
        choose();
        check();
    };

    fill(parts.choose, planSelect(take));
    parts.remove.hidden = !store.get("plan")?.key.startsWith("own:");
}

function save() {
    const name = planName(parts.text.value);

    if (!name) {
        parts.notice.say("bad", t("plans.nameFirst"));
        parts.inputs[0].element.focus();
        return;
    }
    if (!saveOwnPlan(name, parts.text.value)) {
        parts.notice.say("bad", t("plans.notSaved"));
        return;
    }
    choosePlan({ key: `own:${name}`, name, text: parts.text.value });
    choose();
    parts.notice.say("good", t("plans.saved", { name }));
}

function remove() {
    const plan = store.get("plan");
    const own = ownPlans().find((one) => `own:${one.name}` === plan.key);

    removeOwnPlan(own?.name);
    choosePlan({ ...plan, key: "" });
    choose();
    parts.notice.say("info", t("plans.removed", { name: own?.name ?? "" }));
}

function build() {
    const inputs = FIELDS.map(input);
    const textId = newId("plan-text");

    parts = {
        inputs,
        notice: noticeBox(),
        choose: h("div", {}),
        text: h("textarea", { id: textId, rows: 12, maxlength: 4096, spellcheck: "false", autocapitalize: "none", autocomplete: "off",
            wrap: "off", test: "plan-text", "aria-describedby": "plan-found", on: {
                input: () => {
                    toForm();
                    changed();
                    showLines([]);
                },
                scroll: () => {
                    parts.lines.scrollTop = parts.text.scrollTop;
                },
            } }),
        lines: h("div", { class: "lines", "aria-hidden": "true" }),
        verdict: h("p", { class: "notice", test: "plan-verdict", hidden: true }),
        found: h("div", {}),
        remove: h("button", { type: "button", test: "plan-remove", on: { click: remove } }, t("plans.remove")),
    };
    parts.said = h("div", { id: "plan-found", "aria-live": "polite", test: "plan-found" }, parts.verdict, parts.found);
    return [
        h("h1", {}, t("nav.plans")),
        h("section", { class: "panel stack" },
            h("div", { class: "field" }, h("label", { for: "plan-select" }, t("plans.from")), parts.choose), parts.said, parts.notice.element,
            h("div", { class: "row wrap" },
                h("button", { type: "button", class: "primary", test: "plan-use", on: { click: () => {
                    changed();
                    location.hash = "#rig";
                } } }, t("plans.use")),
                h("button", { type: "button", test: "plan-save", on: { click: save } }, t("plans.save")), parts.remove)),
        h("div", { class: "two" },
            h("section", { class: "stack" }, h("h2", {}, t("plans.form")), h("div", { class: "fields" }, inputs.map((one) => one.row))),
            h("section", { class: "stack" }, h("h2", {}, h("label", { for: textId }, t("plans.text"))),
                h("div", { class: "editor" }, parts.lines, parts.text), h("p", { class: "why" }, t("plans.textHelp")))),
    ];
}

export const view = {
    name: "plans",
    mount(root) {
        const show = () => {
            if (!parts)
                return;
            parts.text.value = chosenPlan()?.text ?? "[sweep]\n";
            choose();
            toForm();
            showLines([]);
            check();
        };

        fill(root, build());
        loadPlans().catch((error) => parts?.notice.error(error)).then(show);
    },
    unmount() {
        clearTimeout(timer);
        number += 1;
        parts = null;
    },
};
