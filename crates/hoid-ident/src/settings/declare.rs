//! Macro for the declaration of options.

/// Declares a struct of options: for each field its documentation, unit, bounds and default. The struct implements
/// `Default` and [`Settings`](crate::settings::Settings). Options that several methods share are declared in a separate
/// struct, which is named under `groups`.
///
/// `#[setting(..)]` contains methods of [`Setting`](crate::settings::Setting): `unit`, `bounds`, `default` (as text),
/// `name` (if it differs from the name of the field).
#[macro_export]
macro_rules! settings {
    (
        $(#[doc = $about:literal])+
        pub struct $name:ident {
            $(
                $(#[doc = $help:literal])+
                $(#[setting($($part:ident($value:expr)),+ $(,)?)])?
                pub $field:ident: $type:ty = $default:expr
            ),* $(,)?
        }
        $(groups {
            $(
                $(#[doc = $of_group:literal])+
                pub $group:ident: $group_type:ty
            ),+ $(,)?
        })?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[doc = $help])+ pub $field: $type,)*
            $($($(#[doc = $of_group])+ pub $group: $group_type,)+)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($field: $default,)*
                    $($($group: <$group_type>::default(),)+)?
                }
            }
        }

        impl $crate::settings::Settings for $name {
            fn list(&self) -> Vec<$crate::settings::Setting> {
                #[allow(unused_mut)]
                let mut all = vec![$({
                    let default: $type = $default;
                    $crate::settings::Setting::of(stringify!($field), &default)
                        .help(&[$($help),+])
                        $($(.$part($value))+)?
                }),*];
                $($(all.extend($crate::settings::Settings::list(&self.$group));)+)?
                all
            }

            fn set(&mut self, name: &str, text: &str) -> Result<bool, $crate::IdentError> {
                $({
                    let default: $type = $default;
                    let setting = $crate::settings::Setting::of(stringify!($field), &default)$($(.$part($value))+)?;
                    if setting.name == name {
                        self.$field = setting.read(text)?;
                        return Ok(true);
                    }
                })*
                $($(if $crate::settings::Settings::set(&mut self.$group, name, text)? {
                    return Ok(true);
                })+)?
                Ok(false)
            }

            fn get(&self, name: &str) -> Option<String> {
                $({
                    let default: $type = $default;
                    let setting = $crate::settings::Setting::of(stringify!($field), &default)$($(.$part($value))+)?;
                    if setting.name == name {
                        return $crate::settings::Value::text(&self.$field);
                    }
                })*
                $($(if let Some(found) = $crate::settings::Settings::get(&self.$group, name) {
                    return Some(found);
                })+)?
                None
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use crate::settings::{Bounds, Kind, Settings};

    settings! {
        /// Options that several methods share.
        pub struct SharedOptions {
            /// Multiple of the standard deviation
            #[setting(bounds(Bounds::Positive), default("none"))]
            pub limit: Option<f64> = None,
        }
    }

    settings! {
        /// Options of a method.
        pub struct OwnOptions {
            /// Range of the delay,
            /// both ends included
            #[setting(name("delay"), unit("s"), bounds(Bounds::NonNegative))]
            pub delay_s: (f64, f64) = (0.05, 0.6),
        }
        groups {
            /// Shared data.
            pub shared: SharedOptions,
        }
    }

    #[test]
    fn declared_settings_can_be_listed_set_and_read() {
        let mut own = OwnOptions::default();
        let list = own.list();
        assert_eq!(list.iter().map(|s| s.name).collect::<Vec<_>>(), ["delay", "limit"]);
        assert_eq!(
            (list[0].help.as_str(), list[0].unit),
            ("Range of the delay, both ends included", "s")
        );
        assert_eq!(
            (list[0].default.as_str(), list[1].default.as_str()),
            ("0.05..0.6", "none")
        );
        assert_eq!((list[0].kind, list[1].kind), (Kind::Span, Kind::Number));
        assert!(own.set("limit", "5").unwrap() && own.set("delay", "0.1..0.2").unwrap());
        assert_eq!((own.delay_s, own.shared.limit), ((0.1, 0.2), Some(5.0)));
        assert_eq!(own.get("limit").as_deref(), Some("5"));
        assert_eq!(own.get("other"), None);
        assert!(!own.set("delay_s", "0.1..0.2").unwrap());
        let refused = own.set("limit", "-1").unwrap_err().to_string();
        assert!(refused.contains("limit") && refused.contains("positive"), "{refused}");
        assert!(own.set("delay", "-1..2").is_err());
        assert_eq!(own.shared.limit, Some(5.0));
    }
}
