// What goes wrong. A camera is missing: the preflight is red, says so, and start cannot be pressed; it comes back: green.
// In the sweep one camera loses a frame, which lumid takes again by itself; another goes on losing them until the operator
// chooses those on the page and has them taken again.
import { check, until } from "./bench.mjs";
import { goTo, preflight, press, seesState, sphere, usePlan } from "./operator.mjs";

export const rig = { arc: "4x8:0.2", seconds: 2, settings: { capture: { retakes: 1 } }, patience: 4 };
const FRAMES = 32;

async function red(bench) {
    const page = await bench.open({ size: "tablet" });

    await usePlan(page, bench.plan());
    await bench.fault("camera 2 unplugged");
    await until("the camera is gone", () => bench.log().includes("camera c02 is not there"));
    const found = await preflight(page);
    const reds = Object.entries(found).filter(([, verdict]) => verdict === "red").map(([name]) => name);
    check(reds.some((name) => name.includes("c02")), `no check of c02 is red: ${JSON.stringify(found)}`);
    check(await page.at("start").isDisabled(), "start can be pressed with a red preflight");
    const why = await page.at("start-why").innerText();
    check(why.includes("c02"), `why it cannot be pressed is not said: ${why}`);
    await bench.picture(page, "preflight-red");
    await bench.fault("camera 2 plugged");
    await until("the camera is back", () => /c02 is not there[^]*c02 is there/.test(bench.log()), 60);
    const again = await preflight(page);
    check(!Object.values(again).includes("red"), `still red: ${JSON.stringify(again)}`);
    await until("start can be pressed", () => page.at("start").isEnabled());
    await bench.picture(page, "preflight-green-again");
}

async function retakes(bench) {
    const page = await bench.open({ size: "phone" });

    await usePlan(page, bench.plan());
    await preflight(page);
    await press(page, "start");
    await seesState(page, "sweeping");
    await goTo(page, "sweep");
    await bench.fault("camera 0 frames dropped for 2.5s", "camera 1 frames dropped");
    await until("lost frames are shown", async () => (await sphere(page)).bad > 1, 60);
    await bench.picture(page, "fault-shown");
    await until("the retakes have begun", async () => (await bench.ask("/api/v1/capture")).json.round === 1);
    await seesState(page, "done", 90);
    const { json } = await bench.ask("/api/v1/missing");
    check(json.missing.length > 0, "nothing is left to take again: the fault was too short");
    check(json.missing.every((one) => one.camera === "c01"), `c00 was not taken again: ${JSON.stringify(json)}`);
    await until("what is missing is shown", async () => (await sphere(page)).bad === json.missing.length);
    await bench.picture(page, "missing-at-the-end");

    const bad = page.at("bad-frame");
    await until("every bad frame is in the list", async () => await bad.count() === json.missing.length);
    check((await bad.first().innerText()).includes("c01"), `a bad frame without its camera: ${await bad.first().innerText()}`);
    for (let i = 0; i < json.missing.length; i++)
        await bad.nth(i).locator("input").check();
    await bench.fault("camera 1 frames sent");
    await press(page, "retake-chosen");
    await seesState(page, ["arming", "homing", "sweeping", "preflight"]);
    await bench.picture(page, "retaking");
    await seesState(page, "done", 90);
    await until("all are good", async () => {
        const found = await sphere(page);
        return found.good === FRAMES && found.bad === 0;
    });
    await bench.picture(page, "retaken");
    check((await bench.ask("/api/v1/capture")).json.complete, "the capture is not complete");
}

export const cases = [
    ["a camera is missing: red, and start cannot be pressed; it is back: green", red],
    ["a lost frame is taken again by itself; others when they are chosen", retakes],
];
