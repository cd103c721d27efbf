// The list of what happened, with a filter. The list itself is silent; the newest that matters is read aloud, calmly.
import { entries, entryWords, onEntry } from "./events_log.js";
import { fill, h, setText } from "./dom.js";
import { clock, t } from "./i18n.js";

const ICONS = { bad: "✖", warn: "!", good: "✔", info: "·" };
const FILTERS = { all: () => true, trouble: (entry) => entry.level === "bad" || entry.level === "warn", states: (entry) => entry.kind === "state" };
const CALM_MS = 4000;

function item(entry) {
    return h("li", { test: "event", data: { kind: entry.kind, level: entry.level, number: entry.number } },
        h("span", { class: "event-icon", "aria-hidden": "true" }, ICONS[entry.level]),
        h("time", { datetime: entry.time }, clock(entry.time)), " ",
        h("span", { class: "hidden" }, t(`level.${entry.level}`)), h("span", { class: "event-text" }, entryWords(entry)));
}

// {element, destroy}
export function sweepEvents() {
    let filter = "all", calm = 0, unsaid = null, due = 0;
    const list = h("ol", { class: "events", reversed: true, test: "events" }), none = h("p", { class: "hint" });
    const aloud = h("p", { class: "hidden", role: "status", "aria-live": "polite", test: "event-aloud" });
    const select = h("select", { test: "event-filter", on: { change: () => {
        filter = select.value;
        write();
    } } }, Object.keys(FILTERS).map((name) => h("option", { value: name }, t(`events.${name}`))));

    const write = () => {
        const shown = entries.filter(FILTERS[filter]), there = new Map([...list.children].map((one) => [one.dataset.number, one]));
        due = 0;
        fill(list, shown.map((entry) => there.get(String(entry.number)) ?? item(entry)));
        none.hidden = shown.length > 0;
        setText(none, t("events.none"));
    };
    const say = () => {
        calm = 0;
        if (!unsaid)
            return;
        setText(aloud, entryWords(unsaid));
        unsaid = null;
        calm = setTimeout(say, CALM_MS);
    };
    const off = onEntry((entry) => {
        due ||= requestAnimationFrame(write);
        if (entry.level === "info" && entry.kind !== "state")
            return;
        unsaid = entry;
        if (!calm)
            say();
    });
    write();
    return {
        element: h("section", { class: "events-part", "aria-labelledby": "events-title" }, h("h2", { id: "events-title" }, t("events.title")),
            h("label", { class: "field" }, h("span", {}, t("events.filter")), select), none, list, aloud),
        destroy() {
            off();
            clearTimeout(calm);
            cancelAnimationFrame(due);
        },
    };
}
