        // Points that lie evenly apart along the stretch.
        // The twin of `gather_steps` in renderer/src/cpu/dvr.rs.
        step_number = max(step_number, ceil((from_s - first_step) / step_depth));
        while gathered.w < ENOUGH {
            let s = first_step + step_number * step_depth;
            if s >= to_s {
                break;
            }
            var sent = vec3<f32>(0.0);
            var clear = 1.0;
            var weight = 0.0;
            var id = 0u;
            //EACH
            if covers_LAYER {
                let u = share_at_LAYER(t_LAYER.way, s);
                var paint = looked_up_LAYER(value_at_LAYER(t_LAYER.way, u));
                if paint.w > 0.0 {
                    if params_LAYER.gradients > 0u {
                        paint.w = 1.0 - pow(max(1.0 - paint.w, CLEAREST), gradient_factor_LAYER(t_LAYER.way, u));
                    }
                    let normal = normal_behind_cut_LAYER(t_LAYER, walk_LAYER.pace.direction, u, s, params.skin_mm / mm_per_depth);
                    sent += lit(paint.rgb, normal, view, 1.0, s) * paint.w;
                    clear *= 1.0 - paint.w;
                    weight += paint.w;
                    id = select(id, params_LAYER.id, id == 0u);
                }
            }
            //END
            if weight > 0.0 {
                // Of several volumes at one place each shows by its share of the opacity.
                add(sent * ((1.0 - clear) / weight), 1.0 - clear, s, id);
            }
            step_number += 1.0;
        }
