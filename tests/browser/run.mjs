// Runs one spec: outside, it starts the simulated rig that the spec wants, with itself in the rig's network; inside, lumid
// and the cases one after the other. The first that fails ends it, with a picture of every page that is open.
import { spawn } from "node:child_process";
import { closeSync, openSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { Bench } from "./bench.mjs";

const [lumi, lumid, packages, out, specFile] = process.argv.slice(2);
const spec = await import(pathToFileURL(specFile).href);
const rig = { place: "object", arc: "4x8:0.2", size: "48x48", seconds: 1, options: [], ...spec.rig };

function outside() {
    const log = openSync(join(out, "rig.log"), "w");

    const options = ["--rig", `arc:${rig.arc}`, "--size", rig.size, "--white", "0.008", "--continuous",
        "--position-time", String(rig.seconds), "--patience", String(rig.patience ?? 30),
        "-o", join(out, "rig"), ...rig.options, "--own-network"];
    const child = spawn(lumi, ["sim", "rig", rig.place, ...options, "--", process.execPath, ...process.argv.slice(1)],
        { stdio: ["ignore", "inherit", log] });
    for (const signal of ["SIGINT", "SIGTERM"])
        process.on(signal, () => child.kill("SIGTERM"));
    child.on("close", (status) => {
        closeSync(log);
        if (status !== 0)
            process.stdout.write(readFileSync(join(out, "rig.log"), "utf8"));
        process.exit(status === 0 ? 0 : 1);
    });
}

async function inside() {
    const bench = new Bench({ lumi, lumid, packages, out, folder: process.env.LUMI_SIM_RIG });
    let failed = false;

    try {
        await bench.start(rig.settings ?? {});
        for (const [name, work] of spec.cases) {
            const began = Date.now();
            try {
                await work(bench);
                await bench.endCase();
            } catch (error) {
                failed = true;
                console.log(`FAILED: ${name}\n${error.stack ?? error}`);
                await bench.pictureAll(`failed-${name}`);
                console.log(bench.log().slice(-4000));
                break;
            }
            console.log(`${((Date.now() - began) / 1000).toFixed(1).padStart(6)} s  ${name}`);
        }
    } catch (error) {
        failed = true;
        console.log(error.stack ?? String(error));
    }
    await bench.stop();
    process.exit(failed ? 1 : 0);
}

if (process.env.LUMI_SIM_RIG)
    await inside();
else
    outside();
