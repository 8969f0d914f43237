        // Transparent isosurfaces: every crossing along the stretch, from front to back.
        // The twin of renderer/src/cpu/shells.rs.
        //EACH
        var next_LAYER: Next_LAYER;
        var at_entry_LAYER = false;
        let end_LAYER = share_at_LAYER(t_LAYER.way, to_s);
        if covers_LAYER {
            next_LAYER = next_crossing_LAYER(t_LAYER, share_at_LAYER(t_LAYER.way, from_s), end_LAYER, t_LAYER.fresh);
            at_entry_LAYER = next_LAYER.passes && t_LAYER.fresh && count_levels_LAYER(t_LAYER.cubic.x) != t_LAYER.above;
        }
        //END
        while gathered.w < ENOUGH {
            // The nearest; of equal ones the first volume's.
            var nearest_s = ALL_FAR;
            var whose = -1;
            //EACH
            let s_LAYER = t_LAYER.way.s.x + next_LAYER.u * (t_LAYER.way.s.y - t_LAYER.way.s.x);
            if next_LAYER.passes && s_LAYER < nearest_s {
                nearest_s = s_LAYER;
                whose = LAYER;
            }
            //END
            if whose < 0 {
                break;
            }
            //EACH
            if whose == LAYER {
                let rises = next_LAYER.rises;
                let paint = paint_at_LAYER(select(t_LAYER.above - 1, t_LAYER.above, rises));
                let base = select(paint.rgb, params_LAYER.inner, vec3<bool>(!rises && params_LAYER.has_inner == 1u));
                var normal: vec3<f32>;
                if at_entry_LAYER {
                    normal = closing_normal_LAYER(t_LAYER, walk_LAYER);
                } else {
                    normal = normal_at_LAYER(t_LAYER.way, walk_LAYER.pace.direction, next_LAYER.u);
                }
                if first_id == 0u && paint.w > 0.0 {
                    first_s = s_LAYER;
                    first_id = params_LAYER.id;
                }
                var share = 1.0;
                if SHADOWS && dot(known_normal(normal, view), params.toward_light) > 0.0 {
                    share = share_of_light(pixel, s_LAYER);
                }
                put_behind(lit(base, normal, view, share, s_LAYER), paint.w);
                t_LAYER.above += select(-1, 1, rises);
                let fresh = at_entry_LAYER;
                next_LAYER = next_crossing_LAYER(t_LAYER, next_LAYER.u, end_LAYER, fresh);
                at_entry_LAYER = fresh && next_LAYER.passes && count_levels_LAYER(t_LAYER.cubic.x) != t_LAYER.above;
            }
            //END
        }
