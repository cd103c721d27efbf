// What is done with a capture on the disk. Each says what came of it in the capture's own card.
import { post } from "./api.js";
import { fetchSoon } from "./captures_list.js";
import { askMove } from "./control.js";
import * as dialog from "./dialog.js";
import { h, newId } from "./dom.js";
import { bytes, t } from "./i18n.js";
import { errorWords } from "./words.js";

async function send(notice, path, body, sent, options) {
    notice.say("info", t("sending"));
    try {
        await post(path, body, options);
        notice.say("good", sent);
        fetchSoon();
        return true;
    } catch (error) {
        notice.say("bad", error.word === "absent" ? t("capture.absent") : errorWords(error));
        return false;
    }
}

export function verify(capture, notice) {
    return send(notice, "/api/v1/captures/verify", { capture: capture.name }, t("verify.sent"));
}

export function handOver(capture, notice) {
    return send(notice, "/api/v1/processing", { capture: capture.name, again: true }, t("processing.sent"));
}

export async function retakeMissing(capture, notice) {
    if (await askMove(t("retake.ask"), h("p", {}, t("capture.retake.what", { name: capture.title || capture.name })), t("retake.confirm")))
        await send(notice, "/api/v1/capture/retake", { capture: capture.name }, t("capture.retake.sent"), { moves: true });
}

function choice(value, text, checked) {
    return h("label", { class: "choice" }, h("input", { type: "radio", name: "delete-by", value, checked, test: `delete-by-${value}` }),
        h("span", {}, text));
}

// Deleting cannot be undone, so it wants what only somebody has who means it: the seal that `lumi verify` prints for a copy
// elsewhere, the rig's own second copy, or the capture's name, typed.
class DeleteForm {
    constructor(capture) {
        const id = newId("delete");

        this.capture = capture;
        this.seal = h("input", { type: "text", test: "delete-seal", autocomplete: "off", spellcheck: "false", maxlength: "64",
            "aria-describedby": id });
        this.word = h("input", { type: "text", test: "delete-word", autocomplete: "off", spellcheck: "false", autocapitalize: "none" });
        this.bySeal = h("div", {}, h("label", { class: "field" }, h("span", {}, t("delete.seal")), this.seal),
            h("p", { class: "hint", id }, t("delete.seal.how")));
        this.byWord = h("div", { hidden: true }, h("label", { class: "field" }, h("span", {}, t("delete.word", { name: capture.name })), this.word));
        this.said = h("p", { class: "warn", role: "alert" });
        this.element = h("div", {}, h("p", { class: "warn" }, t("delete.lost", { frames: capture.frames, size: bytes(capture.bytes) })),
            h("p", {}, t(capture.verified?.good ? "delete.verified" : "delete.unverified")),
            h("fieldset", {}, h("legend", {}, t("delete.by")), choice("seal", t("delete.by.seal"), true),
                choice("copy", t("delete.by.copy"), false), choice("word", t("delete.by.word"), false)),
            this.bySeal, this.byWord, this.said);
        this.element.addEventListener("change", () => this.change());
        if (!capture.sealed || !capture.seal) {
            for (const by of ["seal", "copy"])
                this.element.querySelector(`[value="${by}"]`).disabled = true;
            this.element.querySelector('[value="word"]').checked = true;
            this.change();
        }
    }

    by() {
        return this.element.querySelector('input[name="delete-by"]:checked').value;
    }

    change() {
        this.bySeal.hidden = this.by() !== "seal";
        this.byWord.hidden = this.by() !== "word";
    }

    // What lumid is told, or null; then why is said.
    body() {
        const seal = this.seal.value.trim().toLowerCase(), word = this.word.value.trim();
        let why = "";

        if (this.by() === "copy")
            return { capture: this.capture.name, copy: true };
        if (this.by() === "seal")
            why = !/^[0-9a-f]{64}$/.test(seal) ? t("delete.seal.bad") : this.capture.seal && seal !== this.capture.seal ? t("delete.seal.other") : "";
        else
            why = word !== this.capture.name ? t("delete.word.bad", { name: this.capture.name }) : "";
        this.said.textContent = why;
        if (why)
            return null;
        return this.by() === "seal" ? { capture: this.capture.name, seal } : { capture: this.capture.name, word };
    }
}

export async function deleteCapture(capture, notice) {
    const form = new DeleteForm(capture);
    const result = await new Promise((resolve) => {
        const element = h("form", { on: { submit: (event) => {
            event.preventDefault();
            const body = form.body();
            if (body)
                shown.close(body);
        } } }, form.element, h("div", { class: "row end" },
            h("button", { type: "button", test: "dialog-cancel", on: { click: () => shown.close() } }, t("cancel")),
            h("button", { type: "submit", test: "dialog-confirm", class: "primary danger" }, t("delete.button"))));
        const shown = dialog.show(t("delete.title", { name: capture.title || capture.name }), element, { test: "delete-dialog" });
        shown.closed.then(resolve);
    });

    if (result)
        await send(notice, "/api/v1/captures/delete", result, t("delete.sent"));
}
