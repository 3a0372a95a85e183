//! Checks that the imports between the files of a crate have no cycle.
//!
//! A file has an arrow to every other file of which it names an item, by `use` or by a path. `mod` lines and re-exports
//! (`pub use`) are interfaces and give no arrow, and tests may use everything. Names are resolved as by the compiler:
//! through modules, imports and re-exports, to the file that defines the item.
#![allow(clippy::unwrap_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use proc_macro2::{TokenStream, TokenTree};
use syn::{
    Attribute, Item, UseTree, Visibility,
    visit::{self, Visit},
};

/// A module: its file, its definitions, and its imports.
#[derive(Default)]
struct Module {
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    /// Local name, its path, and true for a re-export.
    imports: Vec<(String, Vec<String>, bool)>,
    globs: Vec<(Vec<String>, bool)>,
    /// Paths that occur in the code.
    paths: Vec<Vec<String>>,
}

/// All modules of a crate; the first is its root.
#[derive(Default)]
struct Crate {
    modules: Vec<Module>,
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string().contains("test"))
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

/// Returns the name that an item defines in its module.
fn item_name(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => i.ident.as_ref()?,
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::Type(i) => &i.ident,
        _ => return None,
    };
    Some(name.to_string())
}

impl Module {
    fn add_imports(&mut self, tree: &UseTree, mut before: Vec<String>, again: bool) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.add_imports(&path.tree, before, again);
            }
            UseTree::Name(name) if name.ident == "self" => {
                let local = before.last().unwrap().clone();
                self.imports.push((local, before, again));
            }
            UseTree::Name(name) => {
                let local = name.ident.to_string();
                before.push(local.clone());
                self.imports.push((local, before, again));
            }
            UseTree::Rename(rename) => {
                if rename.ident != "self" {
                    before.push(rename.ident.to_string());
                }
                self.imports.push((rename.rename.to_string(), before, again));
            }
            UseTree::Glob(_) => self.globs.push((before, again)),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.add_imports(tree, before.clone(), again);
                }
            }
        }
    }
}

/// Collects the paths of a module's code, also those within the arguments of macros.
struct Paths<'m>(&'m mut Module);

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.0
            .paths
            .push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, used: &'ast syn::Macro) {
        self.visit_path(&used.path);
        collect_paths(used.tokens.clone(), &mut self.0.paths);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // An import may be within a function.
        self.0.add_imports(&item.tree, Vec::new(), false);
    }
}

/// Returns the names of the types that a macro declares, or would declare if it were used.
fn collect_declared_types(stream: TokenStream, found: &mut BTreeSet<String>) {
    let mut declares = false;
    for token in stream {
        match token {
            TokenTree::Ident(ident) if declares => {
                found.insert(ident.to_string());
                declares = false;
            }
            TokenTree::Ident(ident) => declares = ident == "struct" || ident == "enum",
            TokenTree::Group(group) => collect_declared_types(group.stream(), found),
            _ => declares = false,
        }
    }
}

/// Returns sequences of names that are joined by `::`.
fn collect_paths(stream: TokenStream, found: &mut Vec<Vec<String>>) {
    let (mut run, mut colons) = (Vec::new(), 0);
    for token in stream {
        match token {
            TokenTree::Ident(ident) if colons == 2 && !run.is_empty() => run.push(ident.to_string()),
            TokenTree::Ident(ident) => {
                found.push(std::mem::replace(&mut run, vec![ident.to_string()]));
            }
            TokenTree::Punct(punct) if punct.as_char() == ':' => {
                colons += 1;
                continue;
            }
            other => {
                found.push(std::mem::take(&mut run));
                if let TokenTree::Group(group) = other {
                    collect_paths(group.stream(), found);
                }
            }
        }
        colons = 0;
    }
    found.push(run);
}

impl Crate {
    fn read(root: &Path) -> Self {
        let mut all = Self::default();
        let code = syn::parse_file(&fs::read_to_string(root).unwrap()).unwrap();
        all.add_module(root, root.parent().unwrap(), None, &code.items);
        all
    }

    /// Adds a module; `folder` contains the files of its child modules.
    fn add_module(&mut self, file: &Path, folder: &Path, parent: Option<usize>, items: &[Item]) -> usize {
        let at = self.modules.len();
        self.modules.push(Module {
            file: file.to_owned(),
            parent,
            ..Module::default()
        });
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            self.modules[at].items.extend(item_name(item));
            match item {
                Item::Use(import) => {
                    let again = !matches!(import.vis, Visibility::Inherited);
                    self.modules[at].add_imports(&import.tree, Vec::new(), again);
                }
                Item::Mod(child) => {
                    let name = child.ident.to_string();
                    let inner = folder.join(&name);
                    let index = if let Some((_, items)) = &child.content {
                        self.add_module(file, &inner, Some(at), items)
                    } else {
                        let paths = [folder.join(format!("{name}.rs")), inner.join("mod.rs")];
                        let path = paths.iter().find(|path| path.exists()).unwrap();
                        let code = syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap();
                        self.add_module(path, &inner, Some(at), &code.items)
                    };
                    self.modules[at].children.insert(name, index);
                }
                other => {
                    if let Item::Macro(used) = other {
                        collect_declared_types(used.mac.tokens.clone(), &mut self.modules[at].items);
                    }
                    Paths(&mut self.modules[at]).visit_item(other);
                }
            }
        }
        at
    }

    /// Returns the module that defines the item at the end of a path; `None` for paths that leave the crate or end at a
    /// module.
    fn resolve(&self, from: usize, path: &[String], depth: usize) -> Option<usize> {
        let (first, rest) = path.split_first()?;
        // The path has a cycle of re-exports, or a name that does not exist.
        if depth > 12 {
            return None;
        }
        let module = &self.modules[from];
        match first.as_str() {
            "crate" => return self.resolve(0, rest, depth + 1),
            "self" => return self.resolve(from, rest, depth + 1),
            "super" => return self.resolve(module.parent?, rest, depth + 1),
            _ => {}
        }
        if let Some(&child) = module.children.get(first)
            && !rest.is_empty()
        {
            return self.resolve(child, rest, depth + 1);
        }
        if module.items.contains(first) {
            return Some(from);
        }
        if let Some((_, import, _)) = module.imports.iter().find(|(local, _, _)| local == first) {
            if import.first() == Some(first) && import.len() == 1 {
                return None;
            }
            let whole: Vec<String> = import.iter().chain(rest).cloned().collect();
            return self.resolve(from, &whole, depth + 1);
        }
        module.globs.iter().find_map(|(glob, _)| {
            let whole: Vec<String> = glob.iter().chain(path).cloned().collect();
            (glob.first() != Some(first))
                .then(|| self.resolve(from, &whole, depth + 1))
                .flatten()
        })
    }

    /// Returns the files to which each file has an arrow.
    fn dependencies(&self) -> BTreeMap<&Path, BTreeSet<&Path>> {
        let mut dependencies: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
        for (at, module) in self.modules.iter().enumerate() {
            let imports = module
                .imports
                .iter()
                .filter(|(_, _, again)| !again)
                .map(|(_, path, _)| path);
            let to = dependencies.entry(&module.file).or_default();
            for path in imports.chain(&module.paths) {
                to.extend(self.resolve(at, path, 0).map(|to| self.modules[to].file.as_path()));
            }
            to.remove(module.file.as_path());
        }
        dependencies
    }
}

/// Returns groups of files in which each file reaches all other files of its group.
fn cycles<'p>(dependencies: &BTreeMap<&'p Path, BTreeSet<&'p Path>>) -> Vec<Vec<&'p Path>> {
    let reached = |from: &'p Path| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(at) = open.pop() {
            open.extend(
                dependencies
                    .get(at)
                    .into_iter()
                    .flatten()
                    .filter(|to| seen.insert(**to)),
            );
        }
        seen
    };
    let reach: BTreeMap<&Path, BTreeSet<&Path>> = dependencies.keys().map(|&file| (file, reached(file))).collect();
    let mut left: BTreeSet<&Path> = reach
        .iter()
        .filter(|(file, seen)| seen.contains(*file))
        .map(|(f, _)| *f)
        .collect();
    let mut found = Vec::new();
    while let Some(&first) = left.first() {
        let group: Vec<&Path> = left
            .iter()
            .copied()
            .filter(|f| reach[first].contains(f) && reach[f].contains(first))
            .collect();
        left.retain(|file| !group.contains(file));
        found.push(group);
    }
    found
}

#[test]
fn modules_have_no_import_cycles() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut roots: Vec<PathBuf> = fs::read_dir(crates)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    roots.push(crates.parent().unwrap().join("xtask"));
    roots.sort();
    let mut found = String::new();
    for folder in roots {
        for root in ["src/lib.rs", "src/main.rs"].map(|name| folder.join(name)) {
            if !root.exists() {
                continue;
            }
            let all = Crate::read(&root);
            let dependencies = all.dependencies();
            for circle in cycles(&dependencies) {
                found += &format!("{}\n", folder.file_name().unwrap().display());
                for file in &circle {
                    let short = |path: &Path| path.strip_prefix(folder.join("src")).unwrap().display().to_string();
                    let to: Vec<String> = dependencies[file]
                        .iter()
                        .filter(|to| circle.contains(to))
                        .map(|to| short(to))
                        .collect();
                    found += &format!("    {} -> {}\n", short(file), to.join(", "));
                }
            }
        }
    }
    assert!(found.is_empty(), "circles of imports:\n{found}");
}
