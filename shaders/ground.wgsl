// What the bone stands on. Points are relative to the bone's middle, mm.
// The twin of renderer/src/studio/ground.rs, which draws it.

#import constants, stage

// Where a ray meets it.
struct Met {
    is_met: bool,
    far: f32,
}

// The height of a point above the floor, and how far behind the corner it lies.
fn place(p: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot(p, stage.up) - stage.height, dot(p, stage.behind) - stage.corner);
}

// Whether a point lies before it.
fn before(p: vec3<f32>) -> bool {
    let at = place(p);
    let low = max(stage.radius - at.x, 0.0);
    let deep = max(at.y, 0.0);
    return at.x > 0.0 && low * low + deep * deep < stage.radius * stage.radius;
}

// Where a ray from a point leaves what lies before it.
fn hit_ground(p: vec3<f32>, direction: vec3<f32>) -> Met {
    let at = place(p);
    let h = at.x;
    let b = at.y;
    let rise = dot(direction, stage.up);
    let deepen = dot(direction, stage.behind);
    let floor_far = -h / min(rise, -GRAZING);
    let on_floor = rise < -GRAZING && floor_far > 0.0 && b + floor_far * deepen <= 0.0;
    let wall_far = (stage.radius - b) / max(deepen, GRAZING);
    let on_wall = deepen > GRAZING && wall_far > 0.0 && h + wall_far * rise >= stage.radius;
    // The rounded corner: from within a cylinder the later of its two crossings.
    let low = h - stage.radius;
    let square = rise * rise + deepen * deepen;
    let half = low * rise + b * deepen;
    let discriminant = half * half - square * (low * low + b * b - stage.radius * stage.radius);
    let round_far = (sqrt(max(discriminant, 0.0)) - half) / max(square, GRAZING);
    let is_round =
        discriminant > 0.0 && square > GRAZING && round_far > 0.0 && b + round_far * deepen > 0.0 && low + round_far * rise < 0.0;
    let far = select(select(select(0.0, round_far, is_round), wall_far, on_wall), floor_far, on_floor);
    return Met(on_floor || on_wall || is_round, far);
}

// The normal at a point of it.
fn normal_of_ground(p: vec3<f32>) -> vec3<f32> {
    let at = place(p);
    // A point of the floor, by rounding a little before or behind it.
    if at.y <= 0.0 {
        return stage.up;
    }
    let low = max(stage.radius - at.x, 0.0);
    let deep = max(at.y, 0.0);
    let size = sqrt(low * low + deep * deep);
    return low / size * stage.up - deep / size * stage.behind;
}
