// Reacher-v5's arm in the page: its physics, the policies that move it, and the controls.
// Lengths in m, angles in rad, time in s. A state is {q: [shoulder, elbow], v: their velocities, seen: the angles at
// which MuJoCo measures the fingertip, those of the integrator's last stage}.
const arm = (() => {
  const LINKS = [0.1, 0.11], STEPS = 50, SUBSTEPS = 2, DT = 0.01, GEAR = 200, ARMATURE = 1;
  // Masses in kg and, about their centres, inertias in kg m^2 of the two links and the fingertip: reacher.xml's capsules
  // and sphere at MuJoCo's density of 1000 kg/m^3. Links' centres lie 0.05 m from their joint.
  const MASS = 0.03560472, INERTIA = 3.91756604e-5, TIP_MASS = 0.00418879, TIP_INERTIA = 1.675516e-7, CENTRE = 0.05;
  const COUPLING = LINKS[0] * (MASS * CENTRE + TIP_MASS * LINKS[1]);
  const OUTER = INERTIA + MASS * CENTRE ** 2 + TIP_INERTIA + TIP_MASS * LINKS[1] ** 2;
  const WHOLE = INERTIA + MASS * CENTRE ** 2 + (MASS + TIP_MASS) * LINKS[0] ** 2 + OUTER;
  // The elbow's soft stop: MuJoCo's default solref (0.02 s, damping ratio 1) and solimp (0.9 to 0.95 within 0.001).
  const LIMIT = 3, TIME = 0.02, LOW = 0.9, HIGH = 0.95, WIDTH = 0.001;

  // Each joint's armature dwarfs the links, so it nearly obeys q'' = 200 u - q'; what the links add is the textbook's
  // two-link arm. Integrated by Runge and Kutta's fourth-order rule in steps of 10 ms, as MuJoCo does.
  const acceleration = ([, q, v, w], torque) => {
    const cosine = COUPLING * Math.cos(q), sine = COUPLING * Math.sin(q);
    const a = ARMATURE + WHOLE + 2 * cosine, b = OUTER + cosine, c = ARMATURE + OUTER, determinant = a * c - b * b;
    const first = GEAR * torque[0] - v + sine * w * (2 * v + w), second = GEAR * torque[1] - w - sine * v * v;
    const free = [(c * first - b * second) / determinant, (a * second - b * first) / determinant];
    const side = Math.sign(q), over = Math.abs(q) - LIMIT;
    if (over <= 0) return free;
    const x = Math.min(over / WIDTH, 1), bend = x < 0.5 ? 2 * x * x : 1 - 2 * (1 - x) * (1 - x);
    const share = LOW + (HIGH - LOW) * bend;
    const wanted = -2 / (HIGH * TIME) * w - side * share * over / (HIGH * TIME) ** 2;
    const change = side * Math.min(0, side * share * (wanted - free[1]));
    return [free[0] - b / a * change, free[1] + change];
  };
  const step = (state, action) => {
    const torque = action.map(one => Math.max(-1, Math.min(1, one)));
    const slope = y => [y[2], y[3], ...acceleration(y, torque)], moved = (y, k, h) => y.map((one, i) => one + h * k[i]);
    let y = [...state.q, ...state.v], seen;
    for (let i = 0; i < SUBSTEPS; i++) {
      const k1 = slope(y), k2 = slope(moved(y, k1, DT / 2)), k3 = slope(moved(y, k2, DT / 2)), last = moved(y, k3, DT), k4 = slope(last);
      seen = last.slice(0, 2);
      y = y.map((one, j) => one + DT / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]));
    }
    return {q: y.slice(0, 2), v: y.slice(2), seen};
  };
  const elbow = q => [LINKS[0] * Math.cos(q[0]), LINKS[0] * Math.sin(q[0])];
  const tip = q => {
    const [x, y] = elbow(q);
    return [x + LINKS[1] * Math.cos(q[0] + q[1]), y + LINKS[1] * Math.sin(q[0] + q[1])];
  };
  const distance = (state, target) => {
    const [x, y] = tip(state.seen);
    return Math.hypot(x - target[0], y - target[1]);
  };
  const observe = (state, target) => {
    const [x, y] = tip(state.seen);
    return [...state.q.map(Math.cos), ...state.q.map(Math.sin), ...target, ...state.v, x - target[0], y - target[1]];
  };

  // Random numbers that repeat (mulberry32), and standard normal ones (Box and Muller).
  const generator = seed => () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
  const normal = random => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
  const reset = random => {
    const uniform = limit => limit * (2 * random() - 1);
    const q = [uniform(0.1), uniform(0.1)];
    return {q, v: [uniform(0.005), uniform(0.005)], seen: q};
  };
  const anyTarget = random => {
    for (;;) {
      const target = [0.4 * random() - 0.2, 0.4 * random() - 0.2];
      if (Math.hypot(...target) < 0.2) return target;
    }
  };

  // A policy is a function of an observation; it gives the means of the two torques and their logarithmic deviations.
  const network = text => {
    const bytes = Uint8Array.from(atob(text), one => one.charCodeAt(0));
    const numbers = new Float32Array(bytes.buffer), inputs = 10;
    const hidden = (Math.sqrt((inputs + 4) ** 2 + 4 * (numbers.length - 4)) - inputs - 4) / 2;
    let start = 0;
    const take = count => numbers.subarray(start, start += count);
    const layer = (outputs, width) => ({weights: take(outputs * width), biases: take(outputs)});
    const layers = [layer(hidden, inputs), layer(hidden, hidden), layer(2, hidden)], logStd = take(2);
    const through = ({weights, biases}, input) => Array.from(biases, (bias, row) => {
      let sum = bias;
      for (let i = 0; i < input.length; i++) sum += weights[row * input.length + i] * input[i];
      return sum;
    });
    return observation => {
      let values = observation;
      layers.forEach((one, i) => {
        values = through(one, values);
        if (i < 2) values = values.map(Math.tanh);
      });
      return {mean: values, logStd};
    };
  };
  // Inverse kinematics and a proportional-derivative controller, as in evaluation/controllers.py.
  const controller = (proportional, derivative, most) => observation => {
    const [c0, c1, s0, s1, x, y, v0, v1] = observation, q = [Math.atan2(s0, c0), Math.atan2(s1, c1)];
    const [first, second] = LINKS, cosine = (x * x + y * y - first ** 2 - second ** 2) / (2 * first * second);
    const bend = Math.min(Math.acos(Math.max(-1, Math.min(1, cosine))), most);
    const turns = [bend, -bend].map(angle => {
      const shoulder = Math.atan2(y, x) - Math.atan2(second * Math.sin(angle), first + second * Math.cos(angle));
      const turn = shoulder - q[0] + Math.PI;
      return [turn - 2 * Math.PI * Math.floor(turn / (2 * Math.PI)) - Math.PI, angle - q[1]];
    });
    const [turn] = turns.sort((a, b) => Math.hypot(...a) - Math.hypot(...b));
    return {mean: [proportional * turn[0] - derivative * v0, proportional * turn[1] - derivative * v1], logStd: null};
  };
  const act = (policy, observation, random) => {
    const {mean, logStd} = policy(observation);
    return random && logStd ? mean.map((one, i) => one + Math.exp(logStd[i]) * normal(random)) : mean;
  };

  // One episode: the state and the distance after each step, the start first. Without `random` actions are means.
  const episode = (policy, start, target, steps, random) => {
    const states = [start], distances = [distance(start, target)];
    while (states.length <= steps) {
      const state = states[states.length - 1];
      states.push(step(state, act(policy, observe(state, target), random)));
      distances.push(distance(states[states.length - 1], target));
    }
    return {states, distances};
  };
  const firstTouch = (distances, radius) => distances.findIndex((one, t) => t > 0 && t <= STEPS && one <= radius);
  const rates = (policy, episodes, seed, sampled, radius) => {
    const random = generator(seed);
    let touched = 0, ended = 0;
    for (let i = 0; i < episodes; i++) {
      const {distances} = episode(policy, reset(random), anyTarget(random), STEPS, sampled ? random : null);
      touched += firstTouch(distances, radius) > 0;
      ended += distances[STEPS] <= radius;
    }
    return {touched: touched / episodes, ended: ended / episodes};
  };
  const policyOf = one => one.weights ? network(one.weights) : controller(...one.gains);

  // The controls. `box` holds the drawing and the empty places; `given` the policies, the `radius` of success in
  // m, and the words with holes.
  const mount = (box, given) => {
    const LONG = 150, FRAME = 50, SHOWN = 0.25; // steps an episode goes on at most, ms a step, m to the picture's edge
    const part = name => box.querySelector(`[data-part="${name}"]`), words = given.words, radius = given.radius;
    const fill = (text, holes) => text.replace(/\{(\w+)\}/g, (_, name) => holes[name]);
    const percent = share => `${Math.round(100 * share)} %`, mm = metres => Math.round(1000 * metres);
    const policies = Object.fromEntries(Object.entries(given.policies).map(([name, one]) => [name, policyOf(one)]));
    const random = generator(1 + Math.floor(1e9 * Math.random()));
    let target = [0.12, 0.11], run = null, shown = 0, timer = 0, dragging = false, count = {episodes: 0, touched: 0, ended: 0};
    const chosen = () => part("policy").value;
    const write = (name, text) => { part(name).textContent = text; };

    const draw = () => {
      const state = run.states[shown], points = [[0, 0], elbow(state.q), tip(state.q)];
      const list = all => all.map(([x, y]) => `${(1000 * x).toFixed(1)},${(-1000 * y).toFixed(1)}`).join(" ");
      part("links").setAttribute("points", list(points));
      part("trail").setAttribute("points", list(run.states.slice(Math.max(0, shown - STEPS), shown + 1).map(one => tip(one.q))));
      for (const name of ["tip", "target", "goal"]) {
        const [x, y] = name === "tip" ? points[2] : target;
        part(name).setAttribute("cx", 1000 * x);
        part(name).setAttribute("cy", -1000 * y);
      }
      const path = run.distances.slice(0, shown + 1).map((one, t) => `${2 * t},${(100 - 250 * Math.min(one, 0.4)).toFixed(1)}`);
      part("curve").setAttribute("points", path.join(" "));
      write("now", fill(words.now, {step: shown, distance: mm(run.distances[shown])}));
    };
    const tell = () => {
      const first = firstTouch(run.distances.slice(0, shown + 1), radius), ended = run.distances[STEPS] <= radius;
      let text = shown ? (first > 0 ? fill(words.touched, {step: first}) : words.untouched) : words.start;
      if (shown >= STEPS) text += " " + fill(ended ? words.ended : words.missed, {distance: mm(run.distances[STEPS])});
      if (shown > STEPS) {
        const later = run.distances.slice(STEPS + 1, shown + 1), held = later.filter(one => one <= radius).length;
        text += " " + fill(words.later, {steps: later.length, held: percent(held / later.length)});
      }
      write("said", text);
    };
    const total = () => {
      const {episodes, touched, ended} = count, text = {episodes, touched: percent(touched / episodes), ended: percent(ended / episodes)};
      write("count", episodes ? fill(words.count, text) : "");
    };
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      write("play", words.play);
    };
    const advance = () => {
      if (shown === (part("longer").checked ? LONG : STEPS)) return stop();
      shown++;
      if (shown === STEPS) {
        count.episodes++;
        count.touched += firstTouch(run.distances, radius) > 0;
        count.ended += run.distances[STEPS] <= radius;
        total();
      }
      draw();
      if (shown % 10 === 0 || run.distances[shown] <= radius) tell();
    };
    const prepare = () => {
      stop();
      run = episode(policies[chosen()], reset(random), target, LONG, part("sampled").checked ? random : null);
      shown = 0;
      draw();
      tell();
    };
    const play = () => {
      prepare();
      timer = setInterval(advance, FRAME);
      write("play", words.again);
    };
    const move = (x, y) => {
      const far = Math.hypot(x, y), shrink = far > 0.2 ? 0.2 / far : 1;
      target = [x * shrink, y * shrink];
      prepare();
    };

    const picture = part("picture");
    const place = event => {
      const frame = picture.getBoundingClientRect();
      move(SHOWN * (2 * (event.clientX - frame.left) / frame.width - 1), SHOWN * (1 - 2 * (event.clientY - frame.top) / frame.height));
    };
    const handle = part("target"); // alone, so that a finger elsewhere on the picture scrolls the page
    handle.addEventListener("pointerdown", event => {
      dragging = true;
      handle.setPointerCapture(event.pointerId);
    });
    handle.addEventListener("pointermove", event => { if (dragging) place(event); });
    for (const end of ["pointerup", "pointercancel"]) handle.addEventListener(end, () => {
      if (dragging) play();
      dragging = false;
    });
    const moves = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
    picture.addEventListener("keydown", event => {
      if (event.key in moves) move(target[0] + 0.01 * moves[event.key][0], target[1] + 0.01 * moves[event.key][1]);
      else if (event.key === "Enter" || event.key === " ") play();
      else return;
      event.preventDefault();
    });
    const renew = () => {
      count = {episodes: 0, touched: 0, ended: 0};
      total();
      prepare();
    };
    part("policy").addEventListener("change", renew);
    part("sampled").addEventListener("change", renew);
    part("play").addEventListener("click", play);
    part("other").addEventListener("click", () => {
      target = anyTarget(random);
      play();
    });
    part("many").addEventListener("click", () => {
      const found = rates(policies[chosen()], 200, Math.floor(1e9 * random()), part("sampled").checked, radius);
      count.episodes += 200;
      count.touched += 200 * found.touched;
      count.ended += 200 * found.ended;
      total();
    });
    box.hidden = false;
    prepare();
  };
  return {STEPS, step, tip, distance, observe, network, controller, policyOf, act, episode, rates, generator, mount};
})();
