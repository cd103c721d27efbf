// What is chosen on the sphere or in its table, and taking it again.
import { post } from "./api.js";
import { askMove, RESTING } from "./control.js";
import { h, setText } from "./dom.js";
import { sphere } from "./frames.js";
import { t } from "./i18n.js";
import { KINDS } from "./sphere.js";
import { refresh } from "./state.js";
import { mayOperate, store } from "./store.js";
import { noticeBox } from "./words.js";

const BAD = KINDS.filter((kind) => kind.side === "bad").map((kind) => kind.name);
const SHOWN = 6; // names in the question

function whyNot() {
    if (!sphere.chosen.size)
        return t("retake.why.none");
    if (!mayOperate())
        return t("retake.why.watch");
    if (store.get("connection").state !== "open")
        return t("retake.why.connection");
    if (["preflight", "sealing"].includes(store.get("capture")?.state))
        return t("retake.why.busy");
    return "";
}

function question() {
    const names = sphere.chosenNames(), good = [...sphere.chosen].filter((i) => KINDS[sphere.kinds[i]].side === "good").length;
    const shots = new Set([...sphere.chosen].map((number) => sphere.shotOf(number))).size;

    return h("div", {},
        h("p", {}, t("retake.what", { n: names.length, shots })),
        h("p", { class: "names" }, names.slice(0, SHOWN).join(", ") + (names.length > SHOWN ? " …" : "")),
        good ? h("p", { class: "warn" }, t("retake.good", { n: good })) : null);
}

async function retake(notice, changed) {
    const body = { frames: sphere.chosenNames() }, name = (sphere.capture ?? "").split("/").pop();

    if (name)
        body.capture = name;
    const later = !RESTING.includes(store.get("capture")?.state);
    if (!await askMove(t(later ? "retake.later" : "retake.ask"), question(), t("retake.confirm")))
        return;
    notice.say("info", t("sending"));
    try {
        await post("/api/v1/capture/retake", body, { moves: true });
        notice.say("good", t(later ? "retake.later.sent" : "retake.sent", { n: body.frames.length }));
        sphere.chosen.clear();
    } catch (error) {
        notice.error(error);
    }
    refresh();
    changed();
}

// {element, update}; `changed` is called when more or less is chosen.
export function retakeBar(changed) {
    const count = h("p", { class: "chosen-count", role: "status", test: "chosen-count" }), why = h("p", { class: "why" });
    const notice = noticeBox("retake-notice");
    const choose = (label, kinds) => h("button", { type: "button", test: `choose-${label}`, on: { click: () => {
        sphere.chooseKinds(kinds);
        changed();
    } } }, t(`retake.choose.${label}`));
    const all = [[choose("bad", BAD), BAD], [choose("soft", ["soft"]), ["soft"]], [choose("missing", ["missing"]), ["missing"]]];
    const none = h("button", { type: "button", test: "choose-none", on: { click: () => {
        sphere.chosen.clear();
        changed();
    } } }, t("retake.choose.none"));
    const button = h("button", { type: "button", class: "primary", test: "retake-chosen",
        on: { click: () => retake(notice, changed) } }, t("retake.button"));

    return {
        element: h("div", { class: "retake" },
            h("div", { class: "row wrap", role: "group", "aria-label": t("retake.choose") }, all.map(([one]) => one), none),
            h("div", { class: "row wrap" }, button, count), why, notice.element),
        update() {
            const not = whyNot();
            for (const [one, kinds] of all)
                one.disabled = !KINDS.some((kind, i) => kinds.includes(kind.name) && sphere.counts[i]);
            none.disabled = !sphere.chosen.size;
            button.disabled = not !== "";
            setText(why, not);
            setText(count, t("retake.chosen", { n: sphere.chosen.size }));
        },
    };
}
