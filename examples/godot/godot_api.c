/* See godot_api.h. */
#include "godot_api.h"

#include <stdio.h>
#include <string.h>

GodotApi godot;

enum { MAX_ARGUMENTS = 6, PROPERTY_HINT_RANGE = 1, PROPERTY_USAGE_DEFAULT = 6 };

void godot_error(const char *message) {
  godot.print_error("libupt", message, "libupt", __FILE__, __LINE__, 0);
}

void godot_string_name(GodotStringName *out, const char *text) { godot.string_name_new(out, text); }

void godot_string_name_free(GodotStringName *name) {
  godot.ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING_NAME)(name);
}

static GDExtensionPtrBuiltInMethod builtin(GDExtensionVariantType type, const char *name,
                                           GDExtensionInt hash) {
  GodotStringName method;
  GDExtensionPtrBuiltInMethod found;
  godot_string_name(&method, name);
  found = godot.ptr_builtin_method(type, &method, hash);
  godot_string_name_free(&method);
  return found;
}

bool godot_api_load(GDExtensionInterfaceGetProcAddress lookup, GDExtensionClassLibraryPtr library) {
  /* The hash of PackedVector3Array.resize and PackedInt32Array.resize in extension_api.json. */
  const GDExtensionInt resize_hash = 848867239;
  bool complete = true;
  godot.library = library;
#define FIND(field, type, name)                                                                    \
  godot.field = (type)(void *)lookup(name);                                                        \
  if (!godot.field) {                                                                              \
    fprintf(stderr, "libupt: this Godot has no '%s': 4.3 or newer is needed\n", name);             \
    complete = false;                                                                              \
  }
  FIND(print_error, GDExtensionInterfacePrintErrorWithMessage, "print_error_with_message")
  FIND(string_name_new, GDExtensionInterfaceStringNameNewWithUtf8Chars,
       "string_name_new_with_utf8_chars")
  FIND(string_new, GDExtensionInterfaceStringNewWithUtf8Chars, "string_new_with_utf8_chars")
  FIND(string_to_utf8, GDExtensionInterfaceStringToUtf8Chars, "string_to_utf8_chars")
  FIND(vector3_at, GDExtensionInterfacePackedVector3ArrayOperatorIndex,
       "packed_vector3_array_operator_index")
  FIND(int32_at, GDExtensionInterfacePackedInt32ArrayOperatorIndex,
       "packed_int32_array_operator_index")
  FIND(construct_object, GDExtensionInterfaceClassdbConstructObject, "classdb_construct_object")
  FIND(object_set_instance, GDExtensionInterfaceObjectSetInstance, "object_set_instance")
  FIND(register_class, GDExtensionInterfaceClassdbRegisterExtensionClass3,
       "classdb_register_extension_class3")
  FIND(register_method, GDExtensionInterfaceClassdbRegisterExtensionClassMethod,
       "classdb_register_extension_class_method")
  FIND(register_property, GDExtensionInterfaceClassdbRegisterExtensionClassProperty,
       "classdb_register_extension_class_property")
  FIND(unregister_class, GDExtensionInterfaceClassdbUnregisterExtensionClass,
       "classdb_unregister_extension_class")
  FIND(variant_from_type, GDExtensionInterfaceGetVariantFromTypeConstructor,
       "get_variant_from_type_constructor")
  FIND(variant_to_type, GDExtensionInterfaceGetVariantToTypeConstructor,
       "get_variant_to_type_constructor")
  FIND(ptr_constructor, GDExtensionInterfaceVariantGetPtrConstructor, "variant_get_ptr_constructor")
  FIND(ptr_destructor, GDExtensionInterfaceVariantGetPtrDestructor, "variant_get_ptr_destructor")
  FIND(ptr_builtin_method, GDExtensionInterfaceVariantGetPtrBuiltinMethod,
       "variant_get_ptr_builtin_method")
  FIND(variant_get_type, GDExtensionInterfaceVariantGetType, "variant_get_type")
#undef FIND
  if (!complete)
    return false;
  godot.resize_vector3 =
      builtin(GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR3_ARRAY, "resize", resize_hash);
  godot.resize_int32 = builtin(GDEXTENSION_VARIANT_TYPE_PACKED_INT32_ARRAY, "resize", resize_hash);
  return godot.resize_vector3 && godot.resize_int32;
}

/* Room for any value that the methods take or return. */
typedef union {
  GodotPackedArray packed;
  GodotString string;
  GodotVariant variant;
  float floats[4];
  int64_t integer;
  double real;
} Value;

static void destroy(GDExtensionVariantType type, Value *value) {
  GDExtensionPtrDestructor destructor = godot.ptr_destructor(type);
  if (destructor)
    destructor(value);
}

/* A call with variants (from untyped script code): converts, calls the typed body, converts back.
 */
static void variant_call(void *userdata, GDExtensionClassInstancePtr instance,
                         const GDExtensionConstVariantPtr *arguments, GDExtensionInt count,
                         GDExtensionVariantPtr result, GDExtensionCallError *error) {
  const GodotMethod *method = userdata;
  Value values[MAX_ARGUMENTS], returned;
  GDExtensionConstTypePtr pointers[MAX_ARGUMENTS];
  uint32_t i;
  error->error = GDEXTENSION_CALL_OK;
  if ((uint32_t)count != method->argument_count) {
    error->error = (uint32_t)count < method->argument_count
                       ? GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS
                       : GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS;
    error->expected = (int32_t)method->argument_count;
    return;
  }
  for (i = 0; i < method->argument_count; i++) {
    GDExtensionVariantType given = godot.variant_get_type(arguments[i]);
    GDExtensionVariantType wanted = method->arguments[i].type;
    bool number = given == GDEXTENSION_VARIANT_TYPE_INT && wanted == GDEXTENSION_VARIANT_TYPE_FLOAT;
    if (given != wanted && !number) {
      error->error = GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT;
      error->argument = (int32_t)i;
      error->expected = (int32_t)wanted;
      return;
    }
  }
  memset(values, 0, sizeof values);
  memset(&returned, 0, sizeof returned);
  for (i = 0; i < method->argument_count; i++) {
    godot.variant_to_type(method->arguments[i].type)(&values[i],
                                                     (GDExtensionVariantPtr)arguments[i]);
    pointers[i] = &values[i];
  }
  if (method->result != GDEXTENSION_VARIANT_TYPE_NIL)
    godot.ptr_constructor(method->result, 0)(&returned, NULL);
  method->body(instance, pointers, &returned);
  if (method->result != GDEXTENSION_VARIANT_TYPE_NIL) {
    godot.variant_from_type(method->result)(result, &returned);
    destroy(method->result, &returned);
  }
  for (i = 0; i < method->argument_count; i++)
    destroy(method->arguments[i].type, &values[i]);
}

static void typed_call(void *userdata, GDExtensionClassInstancePtr instance,
                       const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  ((const GodotMethod *)userdata)->body(instance, arguments, result);
}

void godot_register_method(const char *class_name, const GodotMethod *method) {
  GodotStringName class_id, method_id, empty, names[MAX_ARGUMENTS];
  GodotString hint;
  GDExtensionPropertyInfo result, arguments[MAX_ARGUMENTS];
  GDExtensionClassMethodArgumentMetadata metadata[MAX_ARGUMENTS];
  GDExtensionClassMethodInfo info;
  uint32_t i;
  godot_string_name(&class_id, class_name);
  godot_string_name(&method_id, method->name);
  godot_string_name(&empty, "");
  godot.string_new(&hint, "");
  result =
      (GDExtensionPropertyInfo){method->result, &empty, &empty, 0, &hint, PROPERTY_USAGE_DEFAULT};
  for (i = 0; i < method->argument_count; i++) {
    godot_string_name(&names[i], method->arguments[i].name);
    arguments[i] = (GDExtensionPropertyInfo){method->arguments[i].type, &names[i], &empty, 0, &hint,
                                             PROPERTY_USAGE_DEFAULT};
    metadata[i] = GDEXTENSION_METHOD_ARGUMENT_METADATA_NONE;
  }
  memset(&info, 0, sizeof info);
  info.name = &method_id;
  info.method_userdata = (void *)method;
  info.call_func = variant_call;
  info.ptrcall_func = typed_call;
  info.method_flags = GDEXTENSION_METHOD_FLAGS_DEFAULT;
  info.has_return_value = method->result != GDEXTENSION_VARIANT_TYPE_NIL;
  info.return_value_info = &result;
  info.return_value_metadata = GDEXTENSION_METHOD_ARGUMENT_METADATA_NONE;
  info.argument_count = method->argument_count;
  info.arguments_info = arguments;
  info.arguments_metadata = metadata;
  godot.register_method(godot.library, &class_id, &info);
  for (i = 0; i < method->argument_count; i++)
    godot_string_name_free(&names[i]);
  godot.ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(&hint);
  godot_string_name_free(&empty);
  godot_string_name_free(&method_id);
  godot_string_name_free(&class_id);
}

void godot_register_property(const char *class_name, const GodotProperty *property) {
  GodotStringName class_id, name, setter, getter, empty;
  GodotString range;
  GDExtensionPropertyInfo info;
  godot_string_name(&class_id, class_name);
  godot_string_name(&name, property->name);
  godot_string_name(&setter, property->setter);
  godot_string_name(&getter, property->getter);
  godot_string_name(&empty, "");
  godot.string_new(&range, property->range);
  info = (GDExtensionPropertyInfo){property->type,      &name,  &empty,
                                   PROPERTY_HINT_RANGE, &range, PROPERTY_USAGE_DEFAULT};
  godot.register_property(godot.library, &class_id, &info, &setter, &getter);
  godot.ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(&range);
  godot_string_name_free(&empty);
  godot_string_name_free(&getter);
  godot_string_name_free(&setter);
  godot_string_name_free(&name);
  godot_string_name_free(&class_id);
}
