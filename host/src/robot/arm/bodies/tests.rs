use super::*;

fn rod(mass_kg: f64, length_m: f64) -> Body {
    let across = mass_kg * length_m * length_m / 12.0;
    Body {
        origin_m: Vector3::zeros(),
        axis: Vector3::y_axis(),
        mass_kg,
        centre_m: Vector3::new(0.0, 0.0, -0.5 * length_m),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(across, across, 0.0)),
    }
}

/// A physical pendulum of large swing has the period of the complete elliptic integral.
#[test]
fn a_rod_swings_with_its_period() {
    let length = 0.8;
    let chain = Bodies::new([rod(1.7, length)], Vector3::new(0.0, 0.0, -length));
    let (mut angle, mut speed) = (SVector::<f64, 1>::new(1.2), SVector::<f64, 1>::zeros());
    let step_s = 1e-5;
    let mut crossings = Vec::new();
    for step in 0..600_000_u32 {
        let before = angle[0];
        let acceleration = chain
            .accelerations(
                &chain.at(&angle),
                &speed,
                &SVector::zeros(),
                &Vector3::zeros(),
                0.0,
            )
            .unwrap();
        speed += acceleration * step_s;
        angle += speed * step_s;
        if before > 0.0 && angle[0] <= 0.0 {
            crossings.push(f64::from(step) * step_s);
        }
    }
    // K(k) by the arithmetic-geometric mean: T = 2 pi / (w0 agm(1, cos(a/2))), w0^2 = 3 g / (2 l).
    let (mut a, mut b) = (1.0_f64, 0.6_f64.cos());
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let period = std::f64::consts::TAU / ((1.5 * GRAVITY_M_S2 / length).sqrt() * a);
    for pair in crossings.windows(2) {
        assert!((pair[1] - pair[0] - period).abs() < 1e-4 * period);
    }
    assert!(crossings.len() >= 3);
}

/// The double pendulum of the textbooks, point masses on massless rods, in relative angles.
#[test]
fn two_links_obey_the_double_pendulums_equations() {
    let point = |mass_kg: f64, length: f64, origin: f64| Body {
        origin_m: Vector3::new(0.0, 0.0, -origin),
        axis: -Vector3::y_axis(),
        mass_kg,
        centre_m: Vector3::new(0.0, 0.0, -length),
        inertia_kg_m2: Matrix3::zeros(),
    };
    let (m1, m2, l1, l2, g) = (1.3, 0.7, 0.5, 0.4, GRAVITY_M_S2);
    let chain = Bodies::new(
        [point(m1, l1, 0.0), point(m2, l2, l1)],
        Vector3::new(0.0, 0.0, -l2),
    );
    for (a, b, u, v) in [
        (0.3_f64, 0.9_f64, 1.0_f64, -2.0_f64),
        (-2.0, 2.5, -0.5, 3.0),
    ] {
        let (q, s) = (SVector::<f64, 2>::new(a, b), SVector::<f64, 2>::new(u, v));
        let found = chain
            .accelerations(&chain.at(&q), &s, &SVector::zeros(), &Vector3::zeros(), 0.0)
            .unwrap();
        // In absolute angles t1 = a, t2 = a + b (e.g. Goldstein): the two coupled equations, solved by Cramer's rule.
        let (t1, t2, w1, w2) = (a, a + b, u, u + v);
        let d = t1 - t2;
        let (a11, a12) = ((m1 + m2) * l1, m2 * l2 * d.cos());
        let (a21, a22) = (l1 * d.cos(), l2);
        let r1 = -m2 * l2 * w2 * w2 * d.sin() - (m1 + m2) * g * t1.sin();
        let r2 = l1 * w1 * w1 * d.sin() - g * t2.sin();
        let det = a11 * a22 - a12 * a21;
        let (f1, f2) = ((r1 * a22 - a12 * r2) / det, (a11 * r2 - a21 * r1) / det);
        assert!((found[0] - f1).abs() < 1e-9 && (found[0] + found[1] - f2).abs() < 1e-9);
    }
}

/// Three bodies in space with all terms: nothing is lost or gained, and half the step halves what the integrator errs.
#[test]
fn a_free_chain_keeps_its_energy() {
    let body = |axis, origin: [f64; 3], mass_kg: f64| Body {
        origin_m: Vector3::from(origin),
        axis,
        mass_kg,
        centre_m: Vector3::new(0.05, 0.02, 0.15),
        inertia_kg_m2: Matrix3::new(0.03, 0.002, 0.0, 0.002, 0.02, 0.001, 0.0, 0.001, 0.01),
    };
    let chain = Bodies::new(
        [
            body(Vector3::z_axis(), [0.0, 0.0, 0.2], 2.0),
            body(Vector3::y_axis(), [0.0, 0.1, 0.2], 1.5),
            body(Vector3::x_axis(), [0.1, 0.0, 0.2], 1.0),
        ],
        Vector3::new(0.0, 0.0, 0.2),
    );
    let payload_kg = 0.5;
    let drift = |step_s: f64| {
        let (mut q, mut s) = (
            SVector::<f64, 3>::new(0.3, 0.8, -0.4),
            SVector::<f64, 3>::new(1.0, -2.0, 1.5),
        );
        let energy = |q: &SVector<f64, 3>, s: &SVector<f64, 3>| {
            let motion = chain.at(q);
            0.5 * s.dot(&(chain.mass(&motion, payload_kg) * s))
                + chain.height_energy(&motion, payload_kg)
        };
        let start = energy(&q, &s);
        let steps = (0.5 / step_s) as u32;
        for _ in 0..steps {
            let a = chain
                .accelerations(
                    &chain.at(&q),
                    &s,
                    &SVector::zeros(),
                    &Vector3::zeros(),
                    payload_kg,
                )
                .unwrap();
            // The midpoint rule: second order.
            let (qm, sm) = (q + s * (0.5 * step_s), s + a * (0.5 * step_s));
            let am = chain
                .accelerations(
                    &chain.at(&qm),
                    &sm,
                    &SVector::zeros(),
                    &Vector3::zeros(),
                    payload_kg,
                )
                .unwrap();
            q += sm * step_s;
            s += am * step_s;
        }
        ((energy(&q, &s) - start) / start).abs()
    };
    let (coarse, fine) = (drift(1e-3), drift(5e-4));
    assert!(fine < 1e-5, "{fine}");
    assert!(fine < 0.35 * coarse, "{coarse} {fine}");
}

#[test]
fn weight_is_the_slope_of_the_energy_of_height() {
    let chain = Bodies::new(
        [
            rod(1.0, 0.3),
            Body {
                origin_m: Vector3::new(0.0, 0.0, -0.3),
                axis: Vector3::x_axis(),
                ..rod(0.8, 0.4)
            },
        ],
        Vector3::new(0.0, 0.1, -0.4),
    );
    let q = SVector::<f64, 2>::new(0.4, -0.7);
    let weight = chain.bias(&chain.at(&q), &SVector::zeros(), 1.1);
    for joint in 0..2 {
        let step = SVector::<f64, 2>::ith(joint, 1e-6);
        let up = chain.height_energy(&chain.at(&(q + step)), 1.1);
        let down = chain.height_energy(&chain.at(&(q - step)), 1.1);
        assert!((weight[joint] - (up - down) / 2e-6).abs() < 1e-7);
    }
}

#[test]
fn drift_is_the_change_of_the_tools_motion() {
    let chain = Bodies::new(
        [
            rod(1.0, 0.3),
            Body {
                origin_m: Vector3::new(0.0, 0.0, -0.3),
                axis: Vector3::x_axis(),
                ..rod(0.8, 0.4)
            },
            Body {
                origin_m: Vector3::new(0.1, 0.0, -0.2),
                axis: Vector3::z_axis(),
                ..rod(0.8, 0.4)
            },
        ],
        Vector3::new(0.2, 0.1, -0.4),
    );
    let (q, s) = (
        SVector::<f64, 3>::new(0.4, -0.7, 1.1),
        SVector::<f64, 3>::new(1.5, -2.0, 0.8),
    );
    let moves = |t: f64| chain.at(&(q + s * t)).tool_moves() * s;
    let expected = (moves(1e-5) - moves(-1e-5)) / 2e-5;
    let found = chain.drift(&chain.at(&q), &s);
    assert!(
        (found - expected).norm() < 1e-8 && found.norm() > 0.1,
        "{found} {expected}"
    );
}
