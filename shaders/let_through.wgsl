// What a volume's transparent surfaces let through of the light on its way to others.
// The twin of renderer/src/cpu/let_through.rs.

#import constants, volume, walk, traveller, intervals, to_light

// What this volume leaves of a share of the light on its way to what a pixel shows at depth s.
fn let_through(pixel: vec2<u32>, s: f32, share_before: f32) -> f32 {
    let way = to_light(line_of(pixel), world_line_of(pixel), s);
    var t: Traveller;
    t.part = way.part;
    var walk = begin_travel(way.line, t.part, vec2<f32>(0.0, FAR));
    t.open = walk.s <= walk.s_out;
    var share = share_before;
    while t.open && share > DARK {
        go_on(&t, &walk);
        if !t.open {
            break;
        }
        // What the light is on its way in from the start on it has not come into.
        if t.way.is_first && t.way.s.x == t.part.begin && !t.part.is_cut {
            t.above = count_levels(t.cubic.x);
        }
        var fresh = true;
        var next = next_crossing(t.cubic, t.above, 0.0, 1.0, fresh);
        while next.passes {
            share *= 1.0 - paint_at(select(t.above - 1, t.above, next.rises)).w;
            fresh = fresh && count_levels(t.cubic.x) != t.above;
            t.above += select(-1, 1, next.rises);
            next = next_crossing(t.cubic, t.above, next.u, 1.0, fresh);
        }
    }
    return share;
}
