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

  // A condition that hardly varies says nothing.
  function varies(name) {
    const values = data.dots.map((dot) => dot.at[name]).filter((x) => x !== null);
    if (values.length < 2) return false;
    const low = Math.min(...values), high = Math.max(...values);
    return high - low > 0.02 * Math.max(Math.abs(low), Math.abs(high));
  }

  function dots() {
    const names = { f_Hz: 'frequency, Hz', slip: 'slip, %', i_A: 'current, A peak', psi_Wb: 'stator flux, Wb', torque_Nm: 'torque, Nm', stator_C: 'stator temperature, °C' };
    const shown = Object.keys(names).filter(varies);
    if (shown.length === 0) return;
    // Noise alone makes the relative error of small signals large, so the floor is the better measure where it is known.
    const byFloor = data.dots.every((dot) => dot.over_floor !== null);
    const unit = byFloor ? 'error over noise floor' : 'error, %';
    const grid = section('Where the model fails', byFloor
      ? 'Current error of each record over its own noise floor, against the operating conditions: 1 is noise alone.'
      : 'Current error in per cent over the operating conditions; one dot is one record (rms), or one point of a table (positive: the model draws more).');
    for (const name of shown) {
      const series = (holdout) => data.dots.filter((dot) => dot.holdout === holdout && dot.at[name] !== null)
        .map((dot) => ({ x: dot.at[name], y: byFloor ? dot.over_floor : dot.error, id: dot.id }));
      const datasets = [{ label: 'fitted', data: series(false), backgroundColor: colour.error, pointRadius: 4 }];
      if (data.dots.some((dot) => dot.holdout)) datasets.push({ label: 'hold-out', data: series(true), backgroundColor: colour.holdout, pointRadius: 5, pointStyle: 'rectRot' });
      chart(grid, 'Error over ' + names[name].split(',')[0], {
        type: 'scatter', data: { datasets: datasets },
        options: {
          scales: { x: axis(names[name], { grace: '4%' }), y: axis(unit, { beginAtZero: true }) },
          plugins: { legend: { display: datasets.length > 1 }, tooltip: { callbacks: { label: (item) => item.raw.id + ': ' + item.raw.y + (byFloor ? '' : ' %') } } }
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

  bars();
  tables();
  dots();
  overlays();
}());
