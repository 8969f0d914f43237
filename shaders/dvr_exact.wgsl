        // The integral along the stretch, piece by piece.
        // The twin of `gather_exactly` in renderer/src/cpu/dvr.rs, which says why each step is as it is.
        //EACH
        if covers_LAYER {
            t_LAYER.above = count_levels_LAYER(cubic_value_LAYER(t_LAYER.cubic, share_at_LAYER(t_LAYER.way, from_s)));
        }
        //END
        var s = from_s;
        while s < to_s && gathered.w < ENOUGH {
            var end = to_s;
            //EACH
            var passes_LAYER = false;
            var rises_LAYER = false;
            var at_LAYER = to_s;
            if covers_LAYER {
                let u_end = share_at_LAYER(t_LAYER.way, to_s);
                let ahead = next_end_LAYER(t_LAYER.cubic, share_at_LAYER(t_LAYER.way, s), u_end, t_LAYER.above);
                passes_LAYER = ahead.passes;
                rises_LAYER = ahead.rises;
                if ahead.passes || ahead.u < u_end {
                    let at = t_LAYER.way.s.x + ahead.u * (t_LAYER.way.s.y - t_LAYER.way.s.x);
                    at_LAYER = min(select(max(at, s + abs(s) * LEAST), at, ahead.passes), to_s);
                }
                end = min(end, at_LAYER);
            }
            //END
            end = max(end, s);
            let whole = end;
            var sent: vec3<f32>;
            var depth: f32;
            var id: u32;
            loop {
                let length_mm = (end - s) * mm_per_depth;
                // For each node the extinction, and the light that is sent.
                var extinction = vec4<f32>(0.0);
                var light = array<vec3<f32>, 4>(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0));
                var most = 0.0;
                id = 0u;
                //EACH
                if covers_LAYER {
                    var kept = 0.0;
                    for (var node = 0u; node < 4u; node++) {
                        let s_node = s + (end - s) * NODES[node];
                        let u = share_at_LAYER(t_LAYER.way, s_node);
                        let paint = paint_between_LAYER(t_LAYER.above, cubic_value_LAYER(t_LAYER.cubic, u));
                        if paint.w > 0.0 {
                            var own = paint.w;
                            if params_LAYER.gradients > 0u {
                                own *= gradient_factor_LAYER(t_LAYER.way, u);
                            }
                            let skin = params.skin_mm / mm_per_depth;
                            let normal = normal_behind_cut_LAYER(t_LAYER, walk_LAYER.pace.direction, u, s_node, skin);
                            light[node] += own * lit(paint.rgb, normal, view, 1.0, s_node);
                            extinction[node] += own;
                            kept += own;
                        }
                    }
                    if kept > most {
                        most = kept;
                        id = params_LAYER.id;
                    }
                }
                //END
                depth = dot(extinction, WEIGHTS) * length_mm;
                if depth > THIN && 0.5 * (s + end) > s {
                    end = 0.5 * (s + end);
                    continue;
                }
                let until_node = (UNTIL * extinction) * length_mm;
                sent = vec3<f32>(0.0);
                for (var node = 0u; node < 4u; node++) {
                    sent += exp(-until_node[node]) * WEIGHTS[node] * length_mm * light[node];
                }
                break;
            }
            add(sent, 1.0 - exp(-depth), end, id);
            //EACH
            if passes_LAYER && at_LAYER <= end && end == whole {
                t_LAYER.above += select(-1, 1, rises_LAYER);
            }
            //END
            s = end;
        }
