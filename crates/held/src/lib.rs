//! `#[derive(HeldBytes)]`: the heap that a value holds is what its fields hold.
//!
//! Every field counts, whether it was there when somebody last thought of memory or not. `#[held(skip)]` leaves one out: it is shared
//! with others, or of a type that holds nothing; `#[held(own)]` counts what an `Arc` points to, where no one else will. The trait is libupt's `crate::memory::HeldBytes`.
//!
//! REQ-035: The memory that models and scenes state is what they hold, to ten percent, and closing gives it back.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::{Data, DeriveInput, Field, Fields, parse_macro_input};

/// Derives `HeldBytes` for a struct or an enum.
#[proc_macro_derive(HeldBytes, attributes(held))]
pub fn derive_held_bytes(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    implementation(&input)
        .unwrap_or_else(syn::Error::into_compile_error)
        .into()
}

fn implementation(input: &DeriveInput) -> syn::Result<TokenStream> {
    let variants: Vec<(TokenStream, &Fields)> = match &input.data {
        Data::Struct(data) => vec![(quote!(Self), &data.fields)],
        Data::Enum(data) => {
            let path = |name| quote!(Self::#name);
            let variants = data.variants.iter();
            variants.map(|v| (path(&v.ident), &v.fields)).collect()
        }
        Data::Union(_) => {
            let text = "HeldBytes: a union does not say which field it holds";
            return Err(syn::Error::new_spanned(input, text));
        }
    };
    let (mut arms, mut plain) = (Vec::new(), Vec::new());
    for (path, fields) in variants {
        let (mut pattern, mut sum) = (Vec::new(), Vec::new());
        for (at, field) in fields.iter().enumerate() {
            let counted = counted(field)?;
            if matches!(counted, Counted::Not) {
                continue;
            }
            let member = match &field.ident {
                Some(name) => quote!(#name),
                None => {
                    let index = syn::Index::from(at);
                    quote!(#index)
                }
            };
            let value = format_ident!("field_{at}");
            pattern.push(quote!(#member: #value));
            if matches!(counted, Counted::Behind) {
                sum.push(quote!(+ crate::memory::behind(#value)));
                plain.push(quote!(false));
            } else {
                let ty = &field.ty;
                sum.push(quote!(+ crate::memory::HeldBytes::held_bytes(#value)));
                plain.push(quote!(<#ty as crate::memory::HeldBytes>::PLAIN));
            }
        }
        arms.push(quote!(#path { #(#pattern,)* .. } => 0 #(#sum)*,));
    }
    let (name, (generics, arguments, bounds)) = (&input.ident, input.generics.split_for_impl());
    Ok(quote! {
        impl #generics crate::memory::HeldBytes for #name #arguments #bounds {
            const PLAIN: bool = true #(&& #plain)*;

            fn held_bytes(&self) -> usize {
                match self { #(#arms)* }
            }
        }
    })
}

/// What of a field counts.
enum Counted {
    Held,
    /// `own`: what an `Arc` points to.
    Behind,
    /// `skip`.
    Not,
}

fn counted(field: &Field) -> syn::Result<Counted> {
    let mut counted = Counted::Held;
    for attribute in field.attrs.iter().filter(|a| a.path().is_ident("held")) {
        attribute.parse_nested_meta(|meta| {
            counted = match () {
                () if meta.path.is_ident("own") => Counted::Behind,
                () if meta.path.is_ident("skip") => Counted::Not,
                () => return Err(meta.error("`held` knows `own` and `skip`")),
            };
            Ok(())
        })?;
    }
    Ok(counted)
}
