// Draws the report from the JSON in #data. Needs plotly.js; sets data-ready on <body> when every chart stands.
"use strict";
(() => {
  const run = JSON.parse(document.getElementById("data").textContent);
  const main = document.getElementById("report");
  const timeCharts = [];
  const redraw = [];

  // Small helpers ------------------------------------------------------------------------------------------

  const element = (tag, attributes = {}, ...children) => {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...children);
    return node;
  };
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const number = (value, digits = 4) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e7 || size < 1e-4) return value.toExponential(digits - 2);
    return value.toLocaleString("en", { maximumSignificantDigits: digits, useGrouping: size >= 1e4 });
  };
  const duration = (s) => {
    if (s < 120) return `${s.toFixed(3)} s`;
    const whole = Math.floor(s);
    const pad = (n) => String(n).padStart(2, "0");
    return `${Math.floor(whole / 3600)}:${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)} h`;
  };
  const scaled = (values, factor) => values.map((v) => v * factor);
  const axisColour = (index) => css(`--axis-${index}`);
  const section = (title, note, ...nodes) => {
    const head = element("div", { class: "head" }, element("h2", {}, title));
    const node = element("section", {}, head);
    if (note) node.append(element("p", {}, note));
    node.append(...nodes);
    main.append(node);
    return head;
  };

  // Charts -------------------------------------------------------------------------------------------------

  const frame = () => ({ gridcolor: css("--rule"), zerolinecolor: css("--rule"), linecolor: css("--rule"), tickfont: { size: 11.5 } });
  const layoutBase = () => ({
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12.5, color: css("--muted") },
    hoverlabel: { bgcolor: css("--paper"), bordercolor: css("--rule"), font: { color: css("--ink") } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--muted"), activecolor: css("--accent") },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    margin: { l: 70, r: 16, t: 34, b: 40 },
  });
  const config = {
    displaylogo: false,
    displayModeBar: "hover",
    responsive: true,
    modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d", "zoomIn2d", "zoomOut2d", "resetCameraLastSave3d"],
  };

  // `build` returns {traces, layout}; it runs again when the colour scheme changes.
  const chart = (node, build) => {
    const draw = () => {
      const { traces, layout } = build();
      return Plotly.react(node, traces, layout, config);
    };
    redraw.push(draw);
    return draw;
  };

  const zoomTime = (range, source) => {
    const change = range ? { "xaxis.range": range } : { "xaxis.autorange": true };
    for (const node of timeCharts) {
      if (node === source) continue;
      node.following = true;
      Plotly.relayout(node, change).then(() => { node.following = false; });
    }
  };
  const linkTime = (node) => {
    timeCharts.push(node);
    node.on("plotly_relayout", (event) => {
      if (node.following) return;
      const from = event["xaxis.range[0]"];
      if (from !== undefined) zoomTime([from, event["xaxis.range[1]"]], node);
      else if (event["xaxis.autorange"]) zoomTime(null, node);
    });
  };

  // Curves over time. curves: [{name, values, colour, limit}]; a limit is drawn dashed, on both sides of zero if `signed`.
  const overTime = (id, title, note, unit, curves, signed = false) => {
    const node = element("div", { id, class: "chart" });
    const head = section(title, note, node);
    const extent = (values) => values.reduce(([lo, hi], v) => [Math.min(lo, v), Math.max(hi, v)], [0, 0]);
    const [lo, hi] = extent(curves.flatMap((c) => extent(c.values)));
    const limits = new Map();
    for (const curve of curves) {
      if (curve.limit) limits.set(curve.limit, [...(limits.get(curve.limit) ?? []), curve]);
    }
    const highest = Math.max(0, ...limits.keys());
    const peak = Math.max(hi, -lo);
    let showLimits = highest > 0 && highest < 3 * peak;

    const range = () => {
      const top = showLimits ? Math.max(hi, highest) : hi;
      const bottom = showLimits && signed ? Math.min(lo, -highest) : lo;
      const margin = 0.08 * (top - bottom || 1);
      return [bottom < 0 ? bottom - margin : 0, top + margin];
    };
    const limitLabel = (limit, owners) => `${owners.map((c) => c.name).join(" ")} limit ${number(limit)}`;
    const draw = chart(node, () => {
      const layout = layoutBase();
      const [bottom, top] = range();
      layout.xaxis = { ...frame(), title: { text: "time, s", font: { size: 12 }, standoff: 6 }, hoverformat: ".4f", showspikes: true, spikethickness: 1, spikedash: "solid", spikecolor: css("--muted") };
      layout.yaxis = { ...frame(), title: { text: unit, font: { size: 12 } }, range: [bottom, top], exponentformat: "power", automargin: true };
      if (node.layout?.xaxis?.autorange === false) layout.xaxis.range = node.layout.xaxis.range;
      layout.hovermode = "x unified";
      layout.showlegend = curves.length > 1;
      layout.shapes = [];
      layout.annotations = [];
      for (const [limit, owners] of limits) {
        const colour = owners.length > 1 ? css("--muted") : owners[0].colour();
        for (const y of signed ? [limit, -limit] : [limit]) {
          layout.shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, y0: y, y1: y, line: { color: colour, width: 1.4, dash: "dash" } });
        }
        if (limit <= top) {
          layout.annotations.push({ xref: "paper", x: 1, xanchor: "right", y: limit, yanchor: "top", text: limitLabel(limit, owners), showarrow: false, bgcolor: css("--paper"), font: { size: 11, color: colour } });
        }
      }
      const hidden = [...limits].filter(([limit]) => limit > top).map(([limit, owners]) => limitLabel(limit, owners));
      if (hidden.length) {
        layout.annotations.push({ xref: "paper", x: 1, xanchor: "right", yref: "paper", y: 1.02, yanchor: "bottom", text: `above the scale: ${hidden.join(", ")}`, showarrow: false, font: { size: 11 } });
      }
      const traces = curves.map((curve) => ({
        type: "scatter", mode: "lines", name: curve.name, x: run.t, y: curve.values,
        line: { color: curve.colour(), width: 1.4 }, hovertemplate: `%{y:.5~g} ${unit}`,
      }));
      return { traces, layout };
    });
    if (highest > 0) {
      const label = () => (showLimits ? "Fit the curves" : "Show the limits");
      const button = element("button", { type: "button" }, label());
      button.addEventListener("click", () => {
        showLimits = !showLimits;
        button.textContent = label();
        draw();
      });
      head.append(button);
    }
    return draw().then(() => linkTime(node));
  };

  // The page -----------------------------------------------------------------------------------------------

  const lengthUnit = (axis) => (axis.linear ? "mm" : "°");
  const micro = (axis) => (axis.linear ? "µm" : "m°");
  const moving = run.axes.map((axis, index) => ({ ...axis, index })).filter((axis) => axis.moves);
  const names = (axes) => axes.map((axis) => axis.name).join(", ");

  const summary = () => {
    document.title = `${run.program} - simulation report`;
    const header = element("header", {}, element("p", {}, `Simulated on ${run.machine}`), element("h1", {}, run.program));
    const facts = [
      ["Duration", duration(run.duration)],
      ["Path length", `${number(run.length, 6)} mm`],
      ["Largest feed", `${number(run.peakFeed * 60, 5)} mm/min`],
      ["Largest contour error", `${number(run.peakContour * 1000)} µm`],
      ["Blocks in motion", number(run.blockCount, 9)],
      ["Servo ticks", `${number(run.ticks, 12)} at ${number(run.servoHz / 1000)} kHz`],
      ...run.facts,
    ];
    const list = element("dl", { class: "facts" });
    for (const [label, value] of facts) list.append(element("div", {}, element("dt", {}, label), element("dd", {}, value)));
    if (run.digest) list.append(element("div", {}, element("dt", {}, "Step stream digest"), element("dd", { class: "code" }, run.digest)));
    header.append(list);
    main.append(header);
    for (const text of run.warnings) main.append(element("p", { class: "warning" }, text));
  };

  const planView = () => {
    const node = element("div", { id: "chart-plan", class: "chart path" });
    const [x, y] = run.space;
    section("Path in plan", "Commanded path and where the table went. Zoom in to see them part; double-click to return.", node);
    return chart(node, () => {
      const layout = layoutBase();
      layout.xaxis = { ...frame(), title: { text: `${x ?? "x"}, mm`, standoff: 6 } };
      layout.yaxis = { ...frame(), title: { text: `${y ?? "y"}, mm` }, scaleanchor: "x", scaleratio: 1 };
      layout.hovermode = "closest";
      layout.dragmode = "zoom";
      const { commanded, actual } = run;
      const traces = [
        { type: "scatter", mode: "lines", name: "commanded", x: commanded.x, y: commanded.y, customdata: commanded.line.map((line, i) => [line, commanded.feed[i] * 60]), hovertemplate: "line %{customdata[0]}<br>%{x:.4f}, %{y:.4f} mm<br>%{customdata[1]:.5~g} mm/min<extra></extra>", line: { color: css("--axis-2"), width: 2 } },
        { type: "scatter", mode: "lines", name: "actual", x: actual.x, y: actual.y, hovertemplate: "actual<br>%{x:.4f}, %{y:.4f} mm<extra></extra>", line: { color: css("--axis-0"), width: 1.2 } },
        { type: "scatter", mode: "markers", name: "start", x: commanded.x.slice(0, 1), y: commanded.y.slice(0, 1), hoverinfo: "skip", marker: { color: css("--axis-1"), size: 9 } },
      ];
      return { traces, layout };
    })();
  };

  const spaceView = () => {
    const node = element("div", { id: "chart-space", class: "chart path" });
    section("Path in space", "Coloured by feed. Drag to turn, scroll to zoom.", node);
    return chart(node, () => {
      const layout = layoutBase();
      const side = (name) => ({ title: { text: `${name ?? ""}, mm` }, gridcolor: css("--rule"), zerolinecolor: css("--rule"), showbackground: false, showspikes: false, tickfont: { size: 11 }, nticks: 6 });
      layout.margin = { l: 0, r: 0, t: 0, b: 0 };
      layout.uirevision = "keep";
      layout.scene = {
        xaxis: side(run.space[0]), yaxis: side(run.space[1]), zaxis: { ...side(run.space[2]), nticks: 3 },
        aspectmode: "data",
        camera: { projection: { type: "orthographic" }, eye: { x: -1.3, y: -1.3, z: 1.3 } },
      };
      const { commanded } = run;
      const feed = scaled(commanded.feed, 60);
      const traces = [{
        type: "scatter3d", mode: "lines", name: "commanded", x: commanded.x, y: commanded.y, z: commanded.z, customdata: commanded.line.map((line, i) => [line, feed[i]]),
        hovertemplate: "line %{customdata[0]}<br>%{x:.4f}, %{y:.4f}, %{z:.4f} mm<br>%{customdata[1]:.5~g} mm/min<extra></extra>",
        line: { width: 5, color: feed, colorscale: "Viridis", cmin: 0, cmax: Math.max(...feed, 1e-9), showscale: true, colorbar: { title: { text: "feed, mm/min", side: "right" }, thickness: 12, len: 0.6, outlinewidth: 0 } },
      }];
      return { traces, layout };
    })();
  };

  const limitsTable = () => {
    const orders = ["Velocity", "Acceleration", "Jerk"];
    const powers = ["/s", "/s²", "/s³"];
    const head = element("tr", {}, element("th", { class: "text" }, "Axis"), ...orders.map((name) => element("th", {}, `${name} `, element("small", {}, "peak / limit"))), element("th", {}, "Following error"));
    const body = element("tbody");
    run.axes.forEach((axis, index) => {
      const swatch = element("span", { class: "swatch", style: `background: var(--axis-${index})` });
      const row = element("tr", {}, element("td", { class: "text" }, swatch, axis.name));
      orders.forEach((_, k) => {
        const share = axis.limits[k] > 0 ? axis.peaks[k] / axis.limits[k] : 0;
        const bar = element("span", { class: share > 1.005 ? "use over" : "use", title: `${(share * 100).toFixed(1)} %` }, element("i", { style: `width: ${Math.min(100, share * 100)}%` }));
        row.append(element("td", {}, `${number(axis.peaks[k])} / ${number(axis.limits[k])} ${lengthUnit(axis)}${powers[k]}`, bar));
      });
      row.append(element("td", {}, `${number(axis.following * 1000)} ${micro(axis)}`));
      body.append(row);
    });
    section("Axes and their limits", "Largest magnitudes of the commanded motion, from exact differences of the commanded positions, tick by tick.",
      element("div", { class: "scroll" }, element("table", { id: "limits" }, element("thead", {}, head), body)));
  };

  const axisCharts = (key, title, note, order, power) => [true, false].map((linear) => {
    const axes = moving.filter((axis) => axis.linear === linear && run[key][axis.index]);
    if (!axes.length) return null;
    const factor = order === null ? 1000 : 1;
    const unit = order === null ? micro(axes[0]) : lengthUnit(axes[0]) + power;
    const curves = axes.map((axis) => ({
      name: axis.name,
      values: factor === 1 ? run[key][axis.index] : scaled(run[key][axis.index], factor),
      colour: () => axisColour(axis.index),
      limit: order === null ? 0 : axis.limits[order],
    }));
    const kind = linear ? "linear" : "rotary";
    return overTime(`chart-${key}-${kind}`, `${title}, ${kind} axes`, note, unit, curves, true);
  });

  const blockTable = () => {
    const columns = ["Start, s", "Duration, s", "Length", "Least feed", "Largest feed"];
    const head = element("tr", {}, element("th", {}, "Line"), element("th", { class: "text" }, "Block"), ...columns.map((name) => element("th", {}, name)));
    const body = element("tbody");
    let chosen = null;
    for (const [line, text, start, time, millimetres, degrees, least, most] of run.blocks) {
      const rotaryOnly = millimetres === 0 && degrees > 0;
      const length = rotaryOnly ? `${degrees.toFixed(3)}°` : `${millimetres.toFixed(3)} mm`;
      const feed = (value) => `${(value * 60).toFixed(1)} ${rotaryOnly ? "°" : "mm"}/min`;
      const cells = [start.toFixed(4), time.toFixed(4), length, feed(least), feed(most)];
      const row = element("tr", {}, element("td", {}, String(line)), element("td", { class: "text code", title: text }, text), ...cells.map((cell) => element("td", {}, cell)));
      row.addEventListener("click", () => {
        chosen?.classList.remove("chosen");
        chosen = chosen === row ? null : row;
        chosen?.classList.add("chosen");
        zoomTime(chosen ? [start, start + time] : null, null);
      });
      body.append(row);
    }
    const rest = run.blockCount - run.blocks.length;
    const note = `Click a block to zoom the curves to it, click again to see the whole run.${rest > 0 ? ` ${rest} further blocks are not listed.` : ""}`;
    section("Blocks", note, element("div", { class: "scroll" }, element("table", { id: "blocks" }, element("thead", {}, head), body)));
  };

  const footer = () => {
    const width = run.ticksPerBucket;
    const reduction = width > 1 ? ` Curves over time show the smallest and the largest value of every ${width} ticks, so no peak is hidden.` : "";
    main.append(element("footer", {}, `Velocity, acceleration and jerk are differences of the commanded position per servo tick.${reduction} Charts drawn with plotly.js (MIT licence).`));
  };

  summary();
  const pending = [planView(), spaceView()];
  limitsTable();
  pending.push(overTime("chart-feed", "Feed", "Along the path.", "mm/min", [{ name: "feed", values: scaled(run.feed, 60), colour: () => css("--accent") }]));
  pending.push(...axisCharts("velocity", "Velocity", null, 0, "/s"));
  pending.push(...axisCharts("acceleration", "Acceleration", null, 1, "/s²"));
  pending.push(...axisCharts("jerk", "Jerk", null, 2, "/s³"));
  pending.push(...axisCharts("following", "Following error", "Command minus motor (m° is 0.001 degree).", null, ""));
  pending.push(overTime("chart-contour", "Contour error", "Distance of the table from the commanded path.", "µm", [{ name: "contour error", values: scaled(run.contour, 1000), colour: () => css("--axis-0") }]));
  const still = run.axes.filter((axis) => !axis.moves);
  if (still.length) main.append(element("p", { id: "still" }, `${names(still)} ${still.length > 1 ? "stay" : "stays"} at rest and ${still.length > 1 ? "have" : "has"} no curves.`));
  blockTable();
  footer();

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw.forEach((draw) => draw()));
  Promise.all(pending).then(() => { document.body.dataset.ready = "true"; });
})();
