// The sphere in words, for screen readers, keyboards and whoever likes lists better: turns × cameras with counts, and every
// bad frame with its reason. What is chosen here is chosen on the sphere.
import { fill, h, setText } from "./dom.js";
import { frames, reasons, sphere } from "./frames.js";
import { number, t } from "./i18n.js";
import { KINDS } from "./sphere.js";
import { mark } from "./sphere_sprites.js";

const LISTED = 200; // bad frames at once
const CALM_MS = 700; // the table is written anew at most so often

// Counts of a camera's frames in the shots [from, end): [good, bad, all]; the bad ones too.
function cell(camera, from, end) {
    const bad = [];
    let good = 0;

    for (let shot = from; shot < end; shot++) {
        const number = shot * sphere.cameras.length + camera, side = KINDS[sphere.kinds[number]].side;
        if (side === "good")
            good++;
        else if (side === "bad")
            bad.push(number);
    }
    return { good, bad, all: end - from };
}

function rowTitle(row, from, end) {
    const shots = { from: number(from), to: number(end - 1) };

    return sphere.turns.whole ? t("table.turn", { turn: number(row), ...shots }) : t("table.shots", shots);
}

class Grid {
    constructor(chose) {
        this.chose = chose;
        this.element = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": t("table.label") });
        this.cells = [];
    }

    build() {
        const starts = sphere.turns.starts;

        this.cells = [];
        fill(this.element, h("table", { class: "sphere-table", test: "sphere-table" },
            h("caption", {}, t("table.caption")),
            h("thead", {}, h("tr", {}, h("th", { scope: "col" }, t("table.row")),
                sphere.cameras.map((name) => h("th", { scope: "col" }, name)))),
            h("tbody", {}, starts.map((from, row) => this.row(row, from, starts[row + 1] ?? sphere.shots)))));
        this.update();
    }

    row(row, from, end) {
        return h("tr", {}, h("th", { scope: "row" }, rowTitle(row, from, end)), sphere.cameras.map((name, camera) => {
            const text = h("span", {}), more = h("span", {});
            const button = h("button", { type: "button", class: "cell-bad", hidden: true, on: { click: () => {
                sphere.choose(cell(camera, from, end).bad);
                this.chose();
            } } }, more);
            this.cells.push({ camera, from, end, text, more, button });
            return h("td", {}, text, button);
        }));
    }

    update() {
        for (const { camera, from, end, text, more, button } of this.cells) {
            const { good, bad, all } = cell(camera, from, end);
            setText(text, `${number(good)}/${number(all)}`);
            setText(more, t("table.bad", { n: bad.length }));
            button.hidden = bad.length === 0;
            button.setAttribute("aria-label", t("table.choose", { n: bad.length, camera: sphere.cameras[camera],
                from: number(from), to: number(end - 1) }));
        }
    }
}

class BadList {
    constructor(chose) {
        this.chose = chose;
        this.rows = new Map();
        this.list = h("ul", { class: "bad-list" });
        this.said = h("p", {});
        this.element = h("div", { class: "bad" }, h("h2", {}, t("bad.title")), this.said, this.list);
    }

    update() {
        const numbers = [...sphere.bad()], shown = new Set(numbers.slice(0, LISTED));

        for (const [number, row] of this.rows) {
            if (!shown.has(number)) {
                row.item.remove();
                this.rows.delete(number);
            }
        }
        let before = null;
        for (const number of shown) {
            const row = this.rows.get(number) ?? this.make(number);
            this.write(number, row);
            const next = before ? before.nextSibling : this.list.firstChild;
            if (next !== row.item)
                this.list.insertBefore(row.item, next);
            before = row.item;
        }
        setText(this.said, numbers.length ? t(numbers.length > LISTED ? "bad.more" : "bad.count",
            { n: numbers.length, shown: shown.size }) : t("bad.none"));
    }

    clear() {
        this.rows.clear();
        this.list.replaceChildren();
    }

    make(number) {
        const box = h("input", { type: "checkbox", on: { change: () => {
            sphere.choose([number], box.checked);
            this.chose();
        } } });
        const icon = h("span", { class: "bad-mark" }), text = h("span", {});
        const item = h("li", { test: "bad-frame", data: { frame: sphere.names[number] ?? "" } },
            h("label", { class: "choice" }, box, icon, text));
        const row = { item, box, icon, text, kind: -1 };

        this.rows.set(number, row);
        return row;
    }

    write(number, row) {
        const kind = KINDS[sphere.kinds[number]].name;

        if (row.kind !== kind) {
            row.kind = kind;
            row.item.dataset.kind = kind;
            fill(row.icon, mark(kind));
        }
        row.box.checked = sphere.chosen.has(number);
        const values = { shot: String(sphere.shotOf(number)), camera: sphere.cameras[sphere.cameraOf(number)],
            kind: t(`kind.${kind}`), reason: reasons.get(number) ?? "" };
        setText(row.text, t(values.reason ? "bad.reason" : "bad.frame", values));
    }
}

// {element, update(what)}; the table is not written while it is folded.
export function sphereTable(chose) {
    const grid = new Grid(chose), bad = new BadList(chose);
    const fold = h("details", { class: "sphere-words", test: "sphere-words", on: { toggle: () => write() } },
        h("summary", {}, t("table.summary")), grid.element);
    const element = h("section", { class: "sphere-said panel" }, bad.element, fold);
    let late = 0, built = null;

    const write = () => {
        clearTimeout(late);
        late = 0;
        if (built !== sphere.directions) {
            built = sphere.directions;
            bad.clear();
            grid.cells = [];
        }
        bad.update();
        if (fold.open && !grid.cells.length)
            grid.build();
        else if (fold.open)
            grid.update();
    };
    return {
        element,
        update(what) {
            element.hidden = frames.state !== "there";
            if (what === "frames" || what === "chosen")
                write();
            else if (!late)
                late = setTimeout(write, CALM_MS);
        },
    };
}
