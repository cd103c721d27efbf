// Every view in both themes and both languages: nothing serious for axe-core, no text missing, nothing wider than the
// screen. The page by keyboard alone, and without WebGL.
import { readFileSync } from "node:fs";
import { check, until } from "./bench.mjs";
import { goTo, seesState, sphere, startsCapture } from "./operator.mjs";

export const rig = { arc: "4x8:0.2" };

// A capture to look at, taken by way of a browser without WebGL.
async function canvas(bench) {
    const page = await bench.open({ webgl: false });

    await startsCapture(page, bench);
    await seesState(page, "sweeping");
    await goTo(page, "sweep");
    await until("frames come", async () => (await sphere(page)).good >= 3);
    check((await sphere(page)).mode === "canvas", "the sphere is not drawn on a plain canvas");
    check(/WebGL/.test(await page.locator("#view").innerText()), "that there is no WebGL is not said");
    await bench.picture(page, "without-webgl");
    await seesState(page, "done", 90);
    await until("all are good", async () => (await sphere(page)).good === 32);
}

async function views(page) {
    return page.locator("#nav-list a").evaluateAll((all) => all.map((one) => one.dataset.test.replace("nav-", "")));
}

async function accessible(page, where, axe) {
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
    const bad = found.violations.filter((one) => ["serious", "critical"].includes(one.impact));

    check(bad.length === 0, `${where}: ${bad.map((one) => `${one.id} (${one.impact}): ${one.help}\n` +
        one.nodes.slice(0, 4).map((node) => `    ${node.html.slice(0, 160)} ${node.failureSummary.split("\n").pop()}`)
            .join("\n")).join("\n")}`);
    return found.violations.map((one) => `${where}: ${one.id} (${one.impact})`);
}

// Words such as "control.pause" are keys of a text that is not there.
async function texts(page, where) {
    const found = await page.evaluate(() => {
        const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        const keys = [];
        while (walker.nextNode())
            for (const [word] of walker.currentNode.data.matchAll(/(?<![\w./-])[a-z]+(\.[a-zA-Z][\w-]*)+(?![\w./-])/g))
                keys.push(word);
        return keys.filter((word) => !/\.(conf|md|tar|jpg|json|txt|local|plan|capture|lumi)$/.test(word));
    });
    check(found.length === 0, `${where}: texts that are missing: ${found.join(", ")}`);
}

async function fits(page, where) {
    const [wide, screen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);

    check(wide <= screen, `${where}: ${wide} pixels wide on a screen of ${screen}`);
    // What a finger presses is large enough for one (WCAG 2.2, 2.5.8).
    const small = await page.evaluate(() => [...document.querySelectorAll("button")].filter((one) => one.checkVisibility())
        .map((one) => [one.innerText, one.getBoundingClientRect()]).filter(([, box]) => box.height < 24 || box.width < 24)
        .map(([text, box]) => `${text} ${box.width}x${box.height}`));
    check(small.length === 0, `${where}: too small for a finger: ${small.join(", ")}`);
}

async function every(bench) {
    const axe = readFileSync(bench.axe, "utf8");
    const minor = new Set();

    for (const [size, theme, language] of [["desktop", "dark", "en"], ["desktop", "light", "de"],
        ["phone", "dark", "de"], ["phone", "light", "en"]]) {
        // lumid answers so as long as there is no light field to look into.
        const page = await bench.open({ size, theme, language, allow: [/status of 409/] });
        await until("the views are there", async () => (await views(page)).length >= 4);
        check(await page.evaluate(() => document.documentElement.lang) === language, `the page is not in ${language}`);
        for (const view of await views(page)) {
            const where = `${view}, ${size}, ${theme}, ${language}`;
            await goTo(page, view);
            await page.waitForTimeout(400);
            for (const one of await accessible(page, where, axe))
                minor.add(one);
            await texts(page, where);
            await fits(page, where);
            await bench.picture(page, `${view}-${size}-${theme}-${language}`);
        }
        await bench.closePage(page);
    }
    bench.figure("findings of axe-core below serious", [...minor].join("; ") || "none");
}

// Nothing but the keys Tab, Enter, arrows and Escape.
async function keyboard(bench) {
    const page = await bench.open();
    const focused = () => page.evaluate(() => document.activeElement?.dataset.test ?? document.activeElement?.className ?? "");
    const tabTo = async (test) => {
        for (let i = 0; i < 80; i++) {
            await page.keyboard.press("Tab");
            if (await focused() === test)
                return;
        }
        throw new Error(`the Tab key does not get to ${test}`);
    };

    await seesState(page, ["done", "idle"]);
    await page.keyboard.press("Tab");
    check(await focused() === "estop", `the first key does not lead to the emergency stop but to ${await focused()}`);
    const ring = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    check(ring !== "none", "what has the focus does not show it");
    await tabTo("nav-plans");
    await page.keyboard.press("Enter");
    await page.locator('#view[data-view="plans"]').waitFor();
    await tabTo("nav-rig");
    await page.keyboard.press("Enter");
    await tabTo("jog");
    await page.keyboard.press("Enter");
    await page.at("dialog-confirm").waitFor();
    await bench.picture(page, "asks-by-keyboard");
    await page.keyboard.press("Escape");
    await page.at("dialog-confirm").waitFor({ state: "detached" });
    check(await focused() === "jog", `after the question the focus is not back but on ${await focused()}`);
    for (let i = 0; i < 3; i++)
        await page.keyboard.press("Escape");
    await until("the emergency stop was sent by the keyboard",
        async () => (await bench.ask("/api/v1/status")).json.rig.faults.includes("estop"));
    await page.at("clear").click();
    await until("it is cleared", async () => (await bench.ask("/api/v1/status")).json.rig.faults.length === 0);
}

export const cases = [
    ["a browser without WebGL says so, and a sweep is watched on a plain canvas", canvas],
    ["every view, both themes, both languages: accessible, complete, and no wider than the screen", every],
    ["the page by keyboard alone", keyboard],
];
