// Draws the charts of a comparison from the JSON in #data. Text reaches the page as text only.
(function () {
  'use strict';
  const data = JSON.parse(document.getElementById('data').textContent);
  const place = document.getElementById('charts');
  const colour = { measured: '#1d2433', model: '#e8590c', error: '#1971c2', holdout: '#7048e8', floor: '#1d2433', bar: '#8fb8e3', holdoutBar: '#bfaef2' };
  Chart.defaults.animation = false;
  Chart.defaults.maintainAspectRatio = false;
  Chart.defaults.font.size = 12;
  Chart.defaults.color = '#5d6880';
  Chart.defaults.plugins.legend.labels.boxWidth = 14;

  function section(title, explanation) {
    const heading = document.createElement('h2');
    heading.textContent = title;
    const words = document.createElement('p');
    words.textContent = explanation;
    const grid = document.createElement('div');
    grid.className = 'grid';
    place.append(heading, words, grid);
    return grid;
  }

  function chart(grid, title, settings, flat) {
    const card = document.createElement('div');
    card.className = 'card';
    const heading = document.createElement('div');
    heading.className = 'title';
    heading.textContent = title;
    const plot = document.createElement('div');
    plot.className = flat ? 'plot flat' : 'plot';
    const canvas = document.createElement('canvas');
    plot.append(canvas);
    card.append(heading, plot);
    grid.append(card);
    if (flat) card.style.gridColumn = '1 / -1';
    return new Chart(canvas, settings);
  }

  function axis(text, more) {
    return Object.assign({ title: { display: true, text: text }, grid: { color: '#eceff4' } }, more);
  }

  function bars() {
    if (data.bars.length < 2) return;
    const grid = section('Error against the noise floor', 'Current error of each record, rms over the signal’s rms, in per cent.');
    const known = data.bars.some((bar) => bar.floor !== null);
    const datasets = [{
      type: 'bar', label: 'error', order: 2, data: data.bars.map((bar) => bar.error),
      backgroundColor: data.bars.map((bar) => bar.holdout ? colour.holdoutBar : colour.bar)
    }];
    if (known) {
      datasets.push({
        type: 'line', label: 'noise floor', order: 1, showLine: false, pointStyle: 'line', pointBorderWidth: 3,
        pointRadius: Math.max(3, Math.min(18, 420 / data.bars.length)), borderColor: colour.floor, backgroundColor: colour.floor,
        data: data.bars.map((bar) => bar.floor)
      });
    }
    const holdout = data.bars.some((bar) => bar.holdout);
    chart(grid, holdout ? 'Records (violet: hold-out)' : 'Records', {
      data: { labels: data.bars.map((bar) => bar.id), datasets: datasets },
      options: { scales: { x: { grid: { display: false }, ticks: { maxRotation: 60, autoSkip: true } }, y: axis('error, %', { beginAtZero: true }) } }
    }, true);
  }

  const channels = { current_A: 'current', input_power_W: 'input power', power_factor: 'power factor', torque_Nm: 'torque', output_power_W: 'output power' };
  const chance = (p) => (p === null ? '' : p < 0.001 ? ', p < 0.001' : ', p = ' + p.toPrecision(2));

  // One card a condition: a bar for each bin of it, in the channel whose error depends on it most.
  function maps() {
    for (const map of data.maps) {
      if (map.conditions.length === 0) continue;
      const stretches = map.from === 'points' ? 'points' : 'stretches';
      const grid = section('Where the model fails: ' + map.from,
        'Error in bins of each operating condition that these data vary, by share of the variation that it explains. p: chance that shuffled conditions do as well, over all conditions'
        + (map.shuffled ? ' (what was shuffled: ' + map.shuffled + ').' : '; too few ' + stretches + ' here to tell.'));
      for (const condition of [...map.conditions].sort((a, b) => b.share - a.share)) {
        const of = (bin) => bin.channels[condition.channel] || { error: null, chi2: null };
        const byNoise = condition.bins.every((bin) => of(bin).chi2 !== null);
        chart(grid, condition.text + chance(condition.p), {
          type: 'bar',
          data: {
            labels: condition.bins.map((bin) => bin.text),
            datasets: [{ data: condition.bins.map((bin) => of(bin).error), backgroundColor: condition.p !== null && condition.p < 0.05 ? colour.model : colour.bar }]
          },
          options: {
            scales: { x: axis(condition.text, { grid: { display: false } }), y: axis(channels[condition.channel] + ' error, %', { beginAtZero: true }) },
            plugins: {
              legend: { display: false },
              tooltip: { callbacks: { afterLabel: (item) => {
                const bin = condition.bins[item.dataIndex];
                return (byNoise ? 'chi2/dof ' + of(bin).chi2 + ', ' : '') + bin.stretches + ' ' + stretches + ' of ' + bin.records + ' records';
              } } }
            }
          }
        });
      }
      heat(map);
    }
  }

  // The same as a table, every channel: cells the redder, the larger the error within its channel.
  function heat(map) {
    const wide = document.createElement('div');
    wide.className = 'wide';
    const table = document.createElement('table');
    wide.append(table);
    const row = (cells, tag) => {
      const line = document.createElement('tr');
      for (const cell of cells) {
        const box = document.createElement(tag);
        box.textContent = cell.text;
        if (cell.left) box.className = 'left';
        if (cell.red !== undefined) box.style.background = 'rgba(232, 89, 12, ' + (0.65 * cell.red).toFixed(3) + ')';
        line.append(box);
      }
      table.append(line);
    };
    const names = Object.keys(channels).filter((name) => map.conditions.some((c) => c.bins.some((bin) => bin.channels[name])));
    const largest = {};
    for (const name of names) {
      largest[name] = Math.max(...map.conditions.flatMap((c) => c.bins.map((bin) => (bin.channels[name] || {}).error || 0)));
    }
    row([{ text: 'condition', left: true }, { text: 'from to', left: true }, { text: map.from === 'points' ? 'points' : 'stretches' }, { text: 'records' }]
      .concat(names.flatMap((name) => [{ text: channels[name] + ' %' }, { text: 'chi2/dof' }])), 'th');
    for (const condition of map.conditions) {
      condition.bins.forEach((bin, k) => {
        const figures = names.flatMap((name) => {
          const c = bin.channels[name] || { error: null, chi2: null };
          const text = (x) => ({ text: x === null ? '-' : String(Number(x.toPrecision(3))) });
          return [Object.assign(text(c.error), { red: c.error === null || !largest[name] ? 0 : c.error / largest[name] }), text(c.chi2)];
        });
        row([{ text: k === 0 ? condition.text : '', left: true }, { text: bin.text, left: true }, { text: String(bin.stretches) }, { text: String(bin.records) }].concat(figures), 'td');
      });
    }
    place.append(wide);
  }

  function spectra() {
    if (data.spectra.length === 0) return;
    const grid = section('Lines of the error', 'Spectrum of the current error of the worst records, stationary frame; marked: orders of the supply f, the slip s and the shaft f_r, and the noise there. '
      + 'Broad hills are misfit that changes with time; a line is what stands above its neighbours and the noise.');
    for (const record of data.spectra) {
      const datasets = [
        { label: 'orders', type: 'scatter', data: record.lines, backgroundColor: colour.model, pointRadius: 4 },
        { label: 'error', type: 'line', data: record.curve, borderColor: colour.error, backgroundColor: colour.error, borderWidth: 1.2, pointRadius: 0 }
      ];
      if (record.lines.every((line) => line.noise !== null)) {
        datasets.push({ label: 'noise', type: 'scatter', pointStyle: 'line', pointBorderWidth: 2, pointRadius: 7, borderColor: colour.floor, backgroundColor: colour.floor,
          data: record.lines.map((line) => ({ x: line.x, y: line.noise, name: line.name, over: line.over, hint: 'noise' })) });
      }
      chart(grid, record.id, {
        type: 'line', data: { datasets: datasets },
        options: {
          scales: { x: axis('frequency, Hz (negative: turns against a, b, c)', { type: 'linear' }), y: axis('amplitude, A', { type: 'logarithmic' }) },
          plugins: { tooltip: { callbacks: { label: (item) => (item.raw.name ? item.raw.name + ' at ' + item.raw.x + ' Hz: ' + item.raw.y + ' A, ' + item.raw.over + ' times noise (' + item.raw.hint + ')' : item.raw.x + ' Hz: ' + item.raw.y + ' A') } } }
        }
      });
    }
  }

  function overlays() {
    if (data.overlays.length === 0) return;
    const grid = section('The worst records', 'Current i_alpha, measured and simulated, where the error is largest; below it the error on its own scale.');
    for (const record of data.overlays) {
      const line = (label, values, side) => ({
        label: label, data: record.t.map((t, k) => ({ x: t, y: values[k] })), borderColor: colour[label], backgroundColor: colour[label],
        borderWidth: label === 'measured' ? 2.5 : 1.4, pointRadius: 0, yAxisID: side
      });
      // The first is drawn on top.
      chart(grid, record.id, {
        type: 'line',
        data: { datasets: [line('model', record.model, 'y'), line('measured', record.measured, 'y'), line('error', record.error, 'error')] },
        options: {
          parsing: false, normalized: true,
          scales: {
            x: axis('time, s', { type: 'linear', min: record.t[0], max: record.t[record.t.length - 1] }),
            error: axis('error, A', { position: 'left', stack: 'parts', stackWeight: 1, offset: true }),
            y: axis('current, A', { position: 'left', stack: 'parts', stackWeight: 2, offset: true })
          }
        }
      });
    }
  }

  function tables() {
    if (data.tables.length === 0) return;
    const grid = section('Operating points', 'Measured and model over slip; the speed is the measured one.');
    const names = { current_A: 'line current, A rms', input_power_W: 'input power, W', power_factor: 'power factor', torque_Nm: 'torque, Nm', output_power_W: 'output power, W' };
    for (const table of data.tables) {
      for (const name of Object.keys(names)) {
        const pick = (which) => table.points.filter((point) => point[name] && point[name][which] !== null && point.slip !== null)
          .map((point) => ({ x: point.slip, y: point[name][which] })).sort((a, b) => a.x - b.x);
        if (pick(0).length === 0) continue;
        chart(grid, table.id + ': ' + names[name], {
          type: 'scatter',
          data: {
            datasets: [
              { label: 'measured', data: pick(0), backgroundColor: colour.measured, pointRadius: 4 },
              { label: 'model', data: pick(1), borderColor: colour.model, backgroundColor: colour.model, showLine: true, pointRadius: 0, borderWidth: 2 }
            ]
          },
          options: { scales: { x: axis('slip, %'), y: axis(names[name]) } }
        });
      }
    }
  }

  // Each model of an improvement: error over what noise leaves, 1 is the floor.
  function waterfall() {
    const falls = data.waterfall;
    const grid = section('Error, step by step', 'Error over what noise leaves (root of chi2 a value): 1 is the noise floor. Hold-out records are never fitted.');
    const datasets = [{ type: 'bar', label: 'fitted', order: 2, data: falls.map((fall) => fall.fitted), backgroundColor: colour.bar }];
    if (falls.some((fall) => fall.holdout !== null)) {
      datasets.push({ type: 'bar', label: 'hold-out', order: 2, data: falls.map((fall) => fall.holdout), backgroundColor: colour.holdoutBar });
    }
    datasets.push({ type: 'line', label: 'noise floor', order: 1, data: falls.map(() => 1), borderColor: colour.floor, backgroundColor: colour.floor, borderWidth: 2, pointRadius: 0 });
    const large = Math.max(...falls.map((fall) => Math.max(fall.fitted, fall.holdout || 0))) > 10;
    chart(grid, 'Waterfall', {
      data: { labels: falls.map((fall) => fall.text), datasets: datasets },
      options: { scales: { x: { grid: { display: false } }, y: axis('error over noise', large ? { type: 'logarithmic', min: 0.5 } : { beginAtZero: true }) } }
    }, true);
  }

  if (data.waterfall) {
    waterfall();
    return;
  }
  bars();
  tables();
  maps();
  spectra();
  overlays();
}());
