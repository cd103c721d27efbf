// What a person at the page does, by the names the page gives its parts (data-test).
import { check, until } from "./bench.mjs";

export async function goTo(page, view) {
    await page.at(`nav-${view}`).click();
    await page.locator(`#view[data-view="${view}"]`).waitFor();
}

export async function stateOf(page) {
    return page.at("state").getAttribute("data-state");
}

export function seesState(page, state, seconds = 60) {
    return until(`the page says ${state}`, async () => (Array.isArray(state) ? state : [state])
        .includes(await stateOf(page)), seconds);
}

export function connected(page, state = "open", seconds = 30) {
    return until(`the page's connection is ${state}`,
        async () => await page.at("connection").getAttribute("data-state") === state, seconds);
}

export async function usePlan(page, text) {
    await goTo(page, "plans");
    await page.at("plan-text").fill(text);
    await until("the plan is found runnable", async () =>
        await page.at("plan-found").getAttribute("data-runnable") === "true");
    await page.at("plan-use").click();
    await page.at("preflight-run").waitFor();
}

// The preflight, until it is over; its verdicts by the checks' names.
export async function preflight(page) {
    await page.at("preflight-run").click();
    await until("the preflight is over", async () => {
        const checks = page.at("check");
        return await checks.count() > 3 && await page.at("check", '[data-verdict="undecided"]').count() === 0 &&
            ["idle", "red"].includes(await stateOf(page));
    }, 90); // a test picture that is lost is waited for
    return page.at("check").evaluateAll((all) =>
        Object.fromEntries(all.map((one) => [one.dataset.name, one.dataset.verdict])));
}

// A button of the controls; on a small screen they are behind "more".
export async function control(page, test) {
    if (!await page.at(test).isVisible())
        await page.at("control-more").click();
    await page.at(test).click();
}

// Presses what moves the rig, and says yes. Gives what the question said of who else is connected.
export async function press(page, test) {
    await control(page, test);
    const people = await page.at("dialog-people").innerText();
    await page.at("dialog-confirm").click();
    return people;
}

// How the frames on the sphere are, by its numbers.
export async function sphere(page) {
    const found = await page.at("sphere").evaluate((one) => ({ ...one.dataset }));
    return { mode: found.mode, good: Number(found.good), bad: Number(found.bad), planned: Number(found.planned) };
}

export async function startsCapture(page, bench) {
    await usePlan(page, bench.plan());
    const verdicts = await preflight(page);
    check(!Object.values(verdicts).includes("red"), `the preflight is red: ${JSON.stringify(verdicts)}`);
    await press(page, "start");
}
