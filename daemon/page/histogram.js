// A histogram on a small canvas; what is clipped at either end is told in words beside it.

// `counts`: pixels by brightness, dark first. The highest bar fills the height; roots, so that small ones are seen.
export function drawHistogram(canvas, counts) {
    const scale = Math.min(2, devicePixelRatio || 1), style = getComputedStyle(canvas);
    const width = Math.max(1, Math.round(canvas.clientWidth * scale)), height = Math.max(1, Math.round(canvas.clientHeight * scale));
    const context = canvas.getContext("2d"), most = Math.sqrt(Math.max(1, ...counts));

    canvas.width = width;
    canvas.height = height;
    const of = (name, otherwise) => style.getPropertyValue(name).trim() || otherwise;
    context.fillStyle = of("--histogram", style.color);
    counts.forEach((count, i) => {
        const end = i === 0 || i === counts.length - 1;
        const from = Math.round(i * width / counts.length), to = Math.round((i + 1) * width / counts.length);
        const bar = Math.sqrt(count) / most * height;
        context.fillStyle = end ? of("--kind-clipped", "#cc79a7") : of("--histogram", style.color);
        context.fillRect(from, height - bar, Math.max(1, to - from), bar);
    });
}
