// A capture as a crew takes it: a plan that cannot be run, one that can; the preflight, green; a sweep that two browsers
// watch to its end, one of them on a phone, the other loaded anew in the middle; a pause; the light field so far, and a
// camera live. Then the capture is verified, downloaded and deleted.
import { createHash } from "node:crypto";
import { readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { spawnSync } from "node:child_process";
import { check, until } from "./bench.mjs";
import { connected, goTo, preflight, press, seesState, sphere, usePlan } from "./operator.mjs";

export const rig = { arc: "4x10:0.2", seconds: 2, settings: { process: { command: "sleep 1" } } };
const FRAMES = 40;

async function badPlan(bench) {
    const page = await bench.open();

    await goTo(page, "plans");
    await page.at("plan-text").fill(bench.plan().replace(/^turns = .*$/m, "turns = many"));
    const problem = page.at("plan-problem").first();
    await problem.waitFor();
    const line = bench.plan().split("\n").findIndex((one) => one.startsWith("turns")) + 1;
    check((await problem.innerText()).includes(String(line)), `line ${line} is not named: ${await problem.innerText()}`);
    await bench.picture(page, "plan-that-cannot-be-run");
    await goTo(page, "rig");
    check(await page.at("start").isDisabled(), "start can be pressed with a plan that cannot be run");

    await usePlan(page, bench.plan());
    check(await page.at("start").isDisabled(), "start can be pressed before the preflight");
    check((await page.at("start-why").innerText()).length > 10, "why start cannot be pressed is not said");
}

const picturesOf = async (page) => Number(await page.at("field-view").getAttribute("data-pictures"));

// The light field, of what there is of it just then, follows a finger.
async function lookInside(bench, page, name) {
    await goTo(page, "preview");
    const field = page.at("field-view");
    await until("a view of the light field is there", async () =>
        await field.getAttribute("data-state") === "there" && Number(await field.getAttribute("data-frames")) > 0);
    const before = await picturesOf(page), box = await field.locator("canvas, img").first().boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 4, box.y + box.height / 2, { steps: 4 });
    await page.mouse.up();
    await until("another view has come", async () => await picturesOf(page) > before);
    await bench.picture(page, name);
}

async function watchCamera(bench, page) {
    const live = page.at("live").first();

    await goTo(page, "preview");
    await until("the first camera is watched without being asked", async () =>
        await live.locator('[data-test="live-toggle"]').getAttribute("aria-pressed") === "true");
    await live.scrollIntoViewIfNeeded(); // what nobody sees does not move
    await until("a camera's picture moves", () => live.locator("img").evaluateAll((all) =>
        all.some((img) => img.src.includes("/live") && img.naturalWidth > 0)));
    await bench.picture(page, "camera-live");
    await live.locator('[data-test="live-toggle"]').click();
}

async function reload(page) {
    const before = (await sphere(page)).good;

    await page.reload();
    await connected(page);
    await goTo(page, "sweep");
    await until("the sphere is back", async () => (await sphere(page)).good >= before);
}

async function sweep(bench) {
    const page = await bench.open();
    const phone = await bench.open({ size: "phone", theme: "light" });

    await goTo(phone, "sweep");
    await usePlan(page, bench.plan());
    const verdicts = await preflight(page);
    check(Object.values(verdicts).every((one) => one === "green"), `not green: ${JSON.stringify(verdicts)}`);
    await bench.picture(page, "preflight-green");
    await press(page, "start");
    await goTo(page, "sweep");
    await seesState(page, "sweeping");
    await until("frames come", async () => (await sphere(page)).good >= 2);
    await page.at("pause").click();
    for (const one of [page, phone])
        await seesState(one, "paused");
    check((await sphere(page)).mode === "webgl", "the sphere is not drawn by WebGL");
    check((await sphere(page)).good < FRAMES, "it was paused too late to show anything");
    await bench.picture(page, "paused");
    await lookInside(bench, page, "light-field-so-far");
    await goTo(page, "sweep");
    await reload(page);
    await seesState(page, "paused");

    const people = await press(page, "resume");
    check(people.length > 0, "who else is connected is not said");
    await seesState(phone, "sweeping");
    await bench.picture(phone, "sweep-phone-bright");
    await reload(page);
    await seesState(page, "done", 90);
    for (const one of [page, phone]) {
        await seesState(one, "done");
        await until("every frame is good on the sphere", async () => {
            const found = await sphere(one);
            return found.good === FRAMES && found.bad === 0 && found.planned === 0;
        });
    }
    await bench.picture(page, "sweep-done");
    await lookInside(bench, page, "light-field-whole");
    await watchCamera(bench, page);
}

async function captures(bench) {
    const page = await bench.open();

    await goTo(page, "captures");
    const capture = page.at("capture").first();
    await capture.waitFor();
    const name = await capture.getAttribute("data-name");
    await bench.picture(page, "captures");
    await capture.locator('[data-test="capture-verify"]').click();
    await until("the capture is verified", async () => {
        const { json } = await bench.ask("/api/v1/captures");
        return json.captures[0].verified?.good;
    });

    const waits = page.waitForEvent("download");
    await capture.locator('[data-test="capture-download"]').click();
    const download = await waits;
    const file = join(bench.out, "bundle.tar");
    await download.saveAs(file);
    const list = spawnSync("tar", ["-tf", file], { encoding: "utf8" });
    check(list.status === 0 && list.stdout.includes("manifest-sha256.txt"), `the bundle is no capture: ${list.stderr}`);
    bench.figure("bundle", `${statSync(file).size} bytes, sha256 ${createHash("sha256").update(readFileSync(file)).digest("hex").slice(0, 12)}`);

    await capture.locator('[data-test="capture-process"]').click();
    await until("it was processed again", () => bench.log().match(/processing is done/g)?.length === 2);

    const stored = async () => (await bench.ask("/api/v1/captures")).json.captures.length;
    const word = async (text) => {
        await capture.locator('[data-test="capture-delete"]').click();
        await page.at("delete-by-word").check();
        await page.at("delete-word").fill(text);
    };
    await word(`${name}x`);
    await bench.picture(page, "delete-asks");
    check(await page.at("dialog-confirm").isDisabled() || await refusedWord(page), "a wrong word is taken");
    await page.at("dialog-cancel").click();
    check(await stored() === 1, "it was deleted though nobody said so");
    await word(name);
    await page.at("dialog-confirm").click();
    await until("it is deleted", async () => await stored() === 0);
    await until("it is gone from the list", async () => await page.at("capture").count() === 0);
}

async function refusedWord(page) {
    await page.at("dialog-confirm").click();
    return page.at("dialog-confirm").isVisible();
}

export const cases = [
    ["a plan that cannot be run is said at its line, and start cannot be pressed", badPlan],
    ["a sweep is watched to its end by two browsers, paused, and one is loaded anew", sweep],
    ["a capture is verified, downloaded, processed, and deleted by its name only", captures],
];
