// The page comes up, on a desk and on a phone, connected, with the emergency stop in reach.
import { check, until } from "./bench.mjs";
import { connected } from "./operator.mjs";

export const rig = { arc: "4x6:0.2" };

export const cases = [
    ["the page is there, on a desk and on a phone", async (bench) => {
        for (const size of ["desktop", "phone"]) {
            const page = await bench.open({ size });
            await connected(page);
            const box = await page.at("estop").boundingBox();
            check(box.y + box.height <= page.viewportSize().height, "the emergency stop is below the screen");
            await until("the rig's state is told", async () =>
                await page.at("state").getAttribute("data-state") === "idle");
            await bench.picture(page, size);
        }
    }],
];
