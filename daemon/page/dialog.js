// Dialogs. They are not of the browser's modal kind, which would put the emergency stop out of reach: everything but
// that is made inert instead, and the focus goes into the dialog and back to where it came from.
import { h, newId } from "./dom.js";
import { t } from "./i18n.js";

const open = [];

// What the dialog is in front of. The emergency stop is not among them.
function parts() {
    return document.querySelectorAll("body > header, body > nav, body > main, body > aside, body > .skip");
}

function hold(on) {
    for (const part of parts())
        part.inert = on;
    for (const other of open.slice(0, -1))
        other.inert = true;
    if (open.length)
        open[open.length - 1].inert = false;
    document.body.classList.toggle("held", on);
}

// Shows `content` under `title` until close() is called. Returns {element, close, closed}; closed is a promise of what
// close() was given, undefined where it was left (Escape). `keep`: Escape does not leave it.
export function show(title, content, { test, keep = false, className = "" } = {}) {
    const before = document.activeElement;
    const id = newId("dialog");
    let end;
    const closed = new Promise((resolve) => {
        end = resolve;
    });
    const element = h("dialog", { class: className, "aria-labelledby": id, test },
        h("h2", { id, tabindex: "-1" }, title), content);
    const close = (result) => {
        if (!element.isConnected)
            return;
        element.close();
        element.remove();
        open.splice(open.indexOf(element), 1);
        hold(open.length > 0);
        before?.isConnected && before.focus();
        end(result);
    };

    element.addEventListener("keydown", (event) => {
        if (event.key === "Escape" && !keep) {
            event.preventDefault();
            close();
        }
    });
    document.body.append(element);
    element.show();
    open.push(element);
    hold(true);
    const first = element.querySelector("[autofocus]") ?? element.querySelector("input, select, textarea, button");
    (first ?? element.querySelector("h2")).focus();
    return { element, close, closed };
}

// Asks; a promise of whether it was confirmed. `content`: elements; `confirm`: the button's text; `danger`: its colour.
export async function ask(title, content, { confirm, danger = false, test } = {}) {
    let dialog = null;
    const form = h("form", { on: { submit: (event) => {
        event.preventDefault();
        dialog.close(true);
    } } },
    content,
    h("div", { class: "row end" },
        h("button", { type: "button", test: "dialog-cancel", on: { click: () => dialog.close(false) } }, t("cancel")),
        h("button", { type: "submit", test: "dialog-confirm", class: danger ? "primary danger" : "primary" }, confirm)));

    dialog = show(title, form, { test: test ?? "dialog" });
    return await dialog.closed === true;
}
