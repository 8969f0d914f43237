// The solvers of the trilinear interpolant take the corner values of a cell.

#import cells, solver

fn entry_in(way: CellPass) -> f32 {
    return first_entry(way.lower, way.upper, way.start, way.end);
}
