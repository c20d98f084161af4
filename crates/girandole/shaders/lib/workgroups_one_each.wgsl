// An invocation for each item.
fn workgroups_of(items: u32) -> u32 { return (items + WORKGROUP - 1u) / WORKGROUP; }
