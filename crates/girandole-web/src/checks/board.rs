//! A textured board: a model of three files.

use crate::difference::Picture;
use crate::serve::Site;
use anyhow::Result;

const MODEL: &str = "mtllib board.mtl\nv -1 0 0\nv 1 0 0\nv 1 2 0\nv -1 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl board\nf 1/1 2/2 3/3 4/4\n";
const MATERIALS: &str = "newmtl board\nKd 1 1 1\nmap_Kd board.png\n";

/// Names and bytes of model, materials and texture.
pub fn files() -> Result<[(&'static str, Vec<u8>); 3]> {
    let texture = Picture { size: [2, 1], pixels: vec![[200, 20, 20], [20, 20, 200]] };
    Ok([("board.obj", MODEL.into()), ("board.mtl", MATERIALS.into()), ("board.png", texture.encode()?)])
}

/// The site with the board, and where on it the model is.
pub fn pages(site: Site) -> Result<Site> {
    Ok(files()?.into_iter().fold(site, |site, (name, bytes)| site.with(&format!("test/{name}"), bytes)))
}

/// Where the model is on the site.
pub const ADDRESS: &str = "test/board.obj";
