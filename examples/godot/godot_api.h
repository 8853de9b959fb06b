/* The few functions of Godot's extension interface that the example needs, looked up by name at
 * load. gdextension_interface.h is written by the engine itself: `godot --headless
 * --dump-gdextension-interface`. */
#ifndef UPT_GODOT_API_H
#define UPT_GODOT_API_H

#include "gdextension_interface.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Sizes of Godot's opaque values in a 64-bit single-precision build (extension_api.json, float_64).
 */
typedef struct {
  uint64_t opaque[1];
} GodotString, GodotStringName;
typedef struct {
  uint64_t opaque[2];
} GodotPackedArray;
typedef struct {
  uint64_t opaque[3];
} GodotVariant;

typedef struct {
  GDExtensionClassLibraryPtr library;
  GDExtensionInterfacePrintErrorWithMessage print_error;
  GDExtensionInterfaceStringNameNewWithUtf8Chars string_name_new;
  GDExtensionInterfaceStringNewWithUtf8Chars string_new;
  GDExtensionInterfaceStringToUtf8Chars string_to_utf8;
  GDExtensionInterfacePackedVector3ArrayOperatorIndex vector3_at;
  GDExtensionInterfacePackedInt32ArrayOperatorIndex int32_at;
  GDExtensionInterfaceClassdbConstructObject construct_object;
  GDExtensionInterfaceObjectSetInstance object_set_instance;
  GDExtensionInterfaceClassdbRegisterExtensionClass3 register_class;
  GDExtensionInterfaceClassdbRegisterExtensionClassMethod register_method;
  GDExtensionInterfaceClassdbRegisterExtensionClassProperty register_property;
  GDExtensionInterfaceClassdbUnregisterExtensionClass unregister_class;
  GDExtensionInterfaceGetVariantFromTypeConstructor variant_from_type;
  GDExtensionInterfaceGetVariantToTypeConstructor variant_to_type;
  GDExtensionInterfaceVariantGetPtrConstructor ptr_constructor;
  GDExtensionInterfaceVariantGetPtrDestructor ptr_destructor;
  GDExtensionInterfaceVariantGetPtrBuiltinMethod ptr_builtin_method;
  GDExtensionInterfaceVariantGetType variant_get_type;
  GDExtensionPtrBuiltInMethod resize_vector3;
  GDExtensionPtrBuiltInMethod resize_int32;
} GodotApi;

extern GodotApi godot;

/* A method of the class: implemented on typed pointers; variant calls are converted to it. */
typedef void (*GodotMethodBody)(void *instance, const GDExtensionConstTypePtr *arguments,
                                GDExtensionTypePtr result);
typedef struct {
  const char *name;
  GodotMethodBody body;
  GDExtensionVariantType result; /* GDEXTENSION_VARIANT_TYPE_NIL: none */
  uint32_t argument_count;
  struct {
    const char *name;
    GDExtensionVariantType type;
  } arguments[6];
} GodotMethod;

/* A property of the class, in the inspector with a slider or a box from `range`
 * ("least,most,step"). Its methods are registered before it. */
typedef struct {
  const char *name;
  GDExtensionVariantType type;
  const char *range, *setter, *getter;
} GodotProperty;

/* Looks up the functions; false (after a message) when the engine is older than 4.3. */
bool godot_api_load(GDExtensionInterfaceGetProcAddress lookup, GDExtensionClassLibraryPtr library);
void godot_string_name(GodotStringName *out, const char *text);
void godot_string_name_free(GodotStringName *name);
void godot_register_method(const char *class_name, const GodotMethod *method);
void godot_register_property(const char *class_name, const GodotProperty *property);
void godot_error(const char *message);

#ifdef __cplusplus
}
#endif

#endif
