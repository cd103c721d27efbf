// Who may do what: names and passwords, a role that may only watch and stop, a phone let in by a code over TLS, a session that
// runs out in mid-sweep.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { spawnSync } from "node:child_process";
import { check, until } from "./bench.mjs";
import { connected, control, goTo, preflight, press, seesState, sphere, usePlan } from "./operator.mjs";

// An address that is not this computer's own alone, as a phone would use.
const ADDRESS = "192.168.77.5";
export const rig = { arc: "4x8:0.2", seconds: 2.5 };
const REFUSED = [/status of 40[13]/];

function network() {
    for (const words of ["link add lumi0 type veth peer name lumi1", `addr add ${ADDRESS}/24 dev lumi0`,
        "link set lumi1 up", "link set lumi0 up"]) {
        const done = spawnSync("ip", words.split(" "), { encoding: "utf8" });
        check(done.status === 0, `ip ${words}: ${done.stderr}`);
    }
}

function user(bench, what, name, password, ...more) {
    const file = join(bench.out, "password");

    writeFileSync(file, `${password}\n`);
    const done = bench.lumiRun("user", what, name, "--users", join(bench.access, "users"), "--password-file", file, ...more);
    check(done.status === 0, done.text);
}

async function logIn(page, name, password) {
    await page.at("login-name").fill(name);
    await page.at("login-password").fill(password);
    await page.at("login-submit").click();
}

async function passwords(bench) {
    network();
    user(bench, "add", "anna", "correct horse");
    user(bench, "add", "willi", "battery staple", "--role", "watch");
    await until("everybody has to log in", async () =>
        (await fetch("http://localhost:8470/api/v1/capture")).status === 401);

    const page = await bench.open({ size: "phone", allow: REFUSED });
    await page.at("login").waitFor();
    check(await page.at("estop").isVisible(), "the login hides the emergency stop");
    await logIn(page, "anna", "correct donkey");
    await until("a wrong password is said", async () =>
        (await page.at("login").locator('[data-test="notice"]').innerText()).length > 10);
    await bench.picture(page, "login-wrong-password");
    await logIn(page, "anna", "correct horse");
    await page.at("login").waitFor({ state: "detached" });
    await connected(page);
    check((await page.at("who").innerText()).includes("anna"), "who is logged in is not said");
}

async function watching(bench) {
    const page = await bench.open({ allow: REFUSED });

    await page.at("login").waitFor();
    await logIn(page, "willi", "battery staple");
    await page.at("login").waitFor({ state: "detached" });
    await connected(page);
    await page.at("preflight-run").waitFor();
    for (const name of ["start", "preflight-run", "pause", "home", "jog", "retake", "stop", "clear"])
        check(await page.at(name).isDisabled(), `who may only watch can press ${name}`);
    await bench.picture(page, "role-watch");
    await page.at("estop").click();
    await until("the emergency stop was sent", async () =>
        (await bench.ask("/api/v1/status")).json.rig.faults.includes("estop"));
    check(await page.at("clear").isDisabled(), "who may only watch can clear a fault");
    await bench.ask("/api/v1/capture/clear", {});
    await until("it is cleared", async () => (await bench.ask("/api/v1/status")).json.rig.faults.length === 0);
}

async function ranOut(bench) {
    // The stream of events is hung up on with the session.
    const page = await bench.open({ allow: [...REFUSED, /ERR_INCOMPLETE_CHUNKED_ENCODING/] });

    await page.at("login").waitFor();
    await logIn(page, "anna", "correct horse");
    await page.at("login").waitFor({ state: "detached" });
    await usePlan(page, bench.plan());
    await preflight(page);
    await press(page, "start");
    await seesState(page, "sweeping");
    await goTo(page, "sweep");
    await until("frames come", async () => (await sphere(page)).good >= 1);
    user(bench, "password", "anna", "another horse altogether");
    await page.at("login").waitFor();
    check(await page.locator('#view[data-view="sweep"]').isVisible(), "the login takes the view away");
    await bench.picture(page, "session-ran-out");
    await logIn(page, "anna", "another horse altogether");
    await page.at("login").waitFor({ state: "detached" });
    await connected(page);
    const { good } = await sphere(page);
    await until("the sphere goes on", async () => (await sphere(page)).good > good, 60);
    await seesState(page, "done", 90);
    await until("all are good", async () => (await sphere(page)).good === 32);
}

async function pairing(bench) {
    const desk = await bench.open({ allow: REFUSED });

    await desk.at("login").waitFor();
    await logIn(desk, "anna", "another horse altogether");
    await desk.at("login").waitFor({ state: "detached" });
    await goTo(desk, "people");
    await desk.at("people-pair").click();
    await desk.at("pair-make").click();
    const code = (await desk.at("pair-code").innerText()).trim();
    await bench.picture(desk, "pairing");

    const phone = await bench.open({ size: "phone", origin: `https://${ADDRESS}:8471`, allow: REFUSED,
        context: { ignoreHTTPSErrors: true } });
    await phone.at("login").waitFor();
    await phone.at("login-code").fill(code);
    await phone.at("login-code-submit").click();
    await phone.at("login").waitFor({ state: "detached" });
    await connected(phone);
    const cookies = await phone.context().cookies();
    check(cookies.every((one) => one.httpOnly && one.secure && one.sameSite === "Strict"),
        `a cookie that is not kept close: ${JSON.stringify(cookies)}`);
    await bench.picture(phone, "paired");
    await until("the desk sees the phone", async () =>
        await desk.at("people").locator("li, tr").count() >= 2);
    await control(phone, "jog");
    await until("who else is connected is said", async () =>
        (await phone.at("dialog-people").innerText()).includes("anna"));
    await phone.at("dialog-cancel").click();
}

export const cases = [
    ["names and passwords; the emergency stop is in reach before", passwords],
    ["who may only watch can stop the rig, and nothing else", watching],
    ["a session runs out in mid-sweep: login in place, and it goes on", ranOut],
    ["a phone is let in by a code, over TLS", pairing],
];
