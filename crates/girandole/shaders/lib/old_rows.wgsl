// Which of the old places belong to each light of the batch.

@group(2) @binding(14) var<uniform> old_rows: array<vec4u, BATCH / 4u>;

fn old_row(index: u32) -> u32 { return old_rows[index / 4u][index % 4u]; }
