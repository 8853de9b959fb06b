// libupt in Unity's WebGL player: the calls of the C ABI, passed on to the WebAssembly module of the npm package (web/src/unity.js), which has a memory of its own.
// Emscripten links this file; it reads older JavaScript than browsers do.
var libupt = {
  $Libupt__deps: ["malloc", "free"],
  $Libupt: {
    bridge: null,
    error: "",
    program: {
      buffer: function () {
        return HEAPU8.buffer;
      },
      malloc: function (bytes) {
        return _malloc(bytes);
      },
      free: function (at) {
        _free(at);
      },
    },
    // The package's modules lie beside the page: a script loads them, since a library of Emscripten's is none itself.
    begin: function (folder) {
      if (Libupt.script) return;
      Libupt.script = document.createElement("script");
      Libupt.script.type = "module";
      Libupt.script.src = folder + "/unity.js";
      Libupt.script.onerror = function () {
        Libupt.error = Libupt.script.src + " cannot be loaded: unpack the npm package libupt there (cargo xtask package --platform web)";
      };
      Libupt.script.onload = function () {
        libuptForUnity.start(Libupt.program).then(
          function (bridge) {
            Libupt.bridge = bridge;
          },
          function (error) {
            Libupt.error = error.message;
          }
        );
      };
      document.head.appendChild(Libupt.script);
    },
    call: function (name, parameters) {
      if (Libupt.bridge === null) return name === "upt_last_error" ? 0 : -7; // UPT_ERR_STATE
      return Libupt.bridge.call(name, parameters);
    },
  },

  // Loads the module from a folder and a bundle from an address: 0 while they come, 1 once they are here, -1 where they are not to be had.
  upt_web_prepare__deps: ["$Libupt"],
  upt_web_prepare: function (folder, address) {
    Libupt.begin(UTF8ToString(folder));
    if (Libupt.error) return -1;
    if (Libupt.bridge === null) return 0;
    var bundle = Libupt.bridge.bundle(UTF8ToString(address));
    return bundle.files ? 1 : bundle.error ? -1 : 0;
  },

  // The share of a bundle that has come, 0 to 1.
  upt_web_progress__deps: ["$Libupt"],
  upt_web_progress: function (address) {
    var bundle = Libupt.bridge && Libupt.bridge.bundle(UTF8ToString(address));
    return bundle && bundle.total ? bundle.done / bundle.total : 0;
  },

  // Why one is not to be had, as a text for `upt_web_free`.
  upt_web_error__deps: ["$Libupt"],
  upt_web_error: function (address) {
    var text = Libupt.error || Libupt.bridge.bundle(UTF8ToString(address)).error || "";
    var bytes = new TextEncoder().encode(text);
    var at = _malloc(bytes.length + 1);
    HEAPU8.set(bytes, at);
    HEAPU8[at + bytes.length] = 0;
    return at;
  },
  upt_web_free__deps: ["$Libupt"],
  upt_web_free: function (at) {
    _free(at);
  },

  upt_init__deps: ["$Libupt"],
  upt_init: function () {
    return Libupt.call("upt_init", arguments);
  },
  upt_shutdown__deps: ["$Libupt"],
  upt_shutdown: function () {
    return Libupt.call("upt_shutdown", arguments);
  },
  upt_version__deps: ["$Libupt"],
  upt_version: function () {
    return Libupt.call("upt_version", arguments);
  },
  upt_abi_version__deps: ["$Libupt"],
  upt_abi_version: function () {
    return Libupt.call("upt_abi_version", arguments);
  },
  upt_last_error__deps: ["$Libupt"],
  upt_last_error: function () {
    return Libupt.call("upt_last_error", arguments);
  },
  upt_status_name__deps: ["$Libupt"],
  upt_status_name: function () {
    return Libupt.call("upt_status_name", arguments);
  },
  upt_set_log__deps: ["$Libupt"],
  upt_set_log: function () {
    return Libupt.call("upt_set_log", arguments);
  },
  upt_providers__deps: ["$Libupt"],
  upt_providers: function () {
    return Libupt.call("upt_providers", arguments);
  },
  upt_model_create__deps: ["$Libupt"],
  upt_model_create: function () {
    return Libupt.call("upt_model_create", arguments);
  },
  upt_model_destroy__deps: ["$Libupt"],
  upt_model_destroy: function () {
    return Libupt.call("upt_model_destroy", arguments);
  },
  upt_model_read_info__deps: ["$Libupt"],
  upt_model_read_info: function () {
    return Libupt.call("upt_model_read_info", arguments);
  },
  upt_model_describe__deps: ["$Libupt"],
  upt_model_describe: function () {
    return Libupt.call("upt_model_describe", arguments);
  },
  upt_model_read_positions__deps: ["$Libupt"],
  upt_model_read_positions: function () {
    return Libupt.call("upt_model_read_positions", arguments);
  },
  upt_model_read_indices__deps: ["$Libupt"],
  upt_model_read_indices: function () {
    return Libupt.call("upt_model_read_indices", arguments);
  },
  upt_model_read_support__deps: ["$Libupt"],
  upt_model_read_support: function () {
    return Libupt.call("upt_model_read_support", arguments);
  },
  upt_model_read_region__deps: ["$Libupt"],
  upt_model_read_region: function () {
    return Libupt.call("upt_model_read_region", arguments);
  },
  upt_model_locate_points__deps: ["$Libupt"],
  upt_model_locate_points: function () {
    return Libupt.call("upt_model_locate_points", arguments);
  },
  upt_scene_create__deps: ["$Libupt"],
  upt_scene_create: function () {
    return Libupt.call("upt_scene_create", arguments);
  },
  upt_scene_destroy__deps: ["$Libupt"],
  upt_scene_destroy: function () {
    return Libupt.call("upt_scene_destroy", arguments);
  },
  upt_scene_reset__deps: ["$Libupt"],
  upt_scene_reset: function () {
    return Libupt.call("upt_scene_reset", arguments);
  },
  upt_scene_step__deps: ["$Libupt"],
  upt_scene_step: function () {
    return Libupt.call("upt_scene_step", arguments);
  },
  upt_scene_step_field__deps: ["$Libupt"],
  upt_scene_step_field: function () {
    return Libupt.call("upt_scene_step_field", arguments);
  },
  upt_scene_read__deps: ["$Libupt"],
  upt_scene_read: function () {
    return Libupt.call("upt_scene_read", arguments);
  },
  upt_scene_submit__deps: ["$Libupt"],
  upt_scene_submit: function () {
    return Libupt.call("upt_scene_submit", arguments);
  },
  upt_scene_poll__deps: ["$Libupt"],
  upt_scene_poll: function () {
    return Libupt.call("upt_scene_poll", arguments);
  },
  upt_scene_wait__deps: ["$Libupt"],
  upt_scene_wait: function () {
    return Libupt.call("upt_scene_wait", arguments);
  },
  upt_scene_sample__deps: ["$Libupt"],
  upt_scene_sample: function () {
    return Libupt.call("upt_scene_sample", arguments);
  },
  upt_scene_set_region__deps: ["$Libupt"],
  upt_scene_set_region: function () {
    return Libupt.call("upt_scene_set_region", arguments);
  },
  upt_scene_decode__deps: ["$Libupt"],
  upt_scene_decode: function () {
    return Libupt.call("upt_scene_decode", arguments);
  },
  upt_scene_attach_points__deps: ["$Libupt"],
  upt_scene_attach_points: function () {
    return Libupt.call("upt_scene_attach_points", arguments);
  },
  upt_scene_read_instruments__deps: ["$Libupt"],
  upt_scene_read_instruments: function () {
    return Libupt.call("upt_scene_read_instruments", arguments);
  },
  upt_scene_read_instrument_contacts__deps: ["$Libupt"],
  upt_scene_read_instrument_contacts: function () {
    return Libupt.call("upt_scene_read_instrument_contacts", arguments);
  },
  upt_hull_create__deps: ["$Libupt"],
  upt_hull_create: function () {
    return Libupt.call("upt_hull_create", arguments);
  },
  upt_hull_destroy__deps: ["$Libupt"],
  upt_hull_destroy: function () {
    return Libupt.call("upt_hull_destroy", arguments);
  },
  upt_scene_read_ties__deps: ["$Libupt"],
  upt_scene_read_ties: function () {
    return Libupt.call("upt_scene_read_ties", arguments);
  },
  upt_scene_tie_points__deps: ["$Libupt"],
  upt_scene_tie_points: function () {
    return Libupt.call("upt_scene_tie_points", arguments);
  },
  upt_scene_bed__deps: ["$Libupt"],
  upt_scene_bed: function () {
    return Libupt.call("upt_scene_bed", arguments);
  },
  upt_scene_cut__deps: ["$Libupt"],
  upt_scene_cut: function () {
    return Libupt.call("upt_scene_cut", arguments);
  },
  upt_scene_cut_with__deps: ["$Libupt"],
  upt_scene_cut_with: function () {
    return Libupt.call("upt_scene_cut_with", arguments);
  },
  upt_scene_remove__deps: ["$Libupt"],
  upt_scene_remove: function () {
    return Libupt.call("upt_scene_remove", arguments);
  },
  upt_scene_tear__deps: ["$Libupt"],
  upt_scene_tear: function () {
    return Libupt.call("upt_scene_tear", arguments);
  },
  upt_scene_scale_stiffness__deps: ["$Libupt"],
  upt_scene_scale_stiffness: function () {
    return Libupt.call("upt_scene_scale_stiffness", arguments);
  },
  upt_scene_drop_fragments__deps: ["$Libupt"],
  upt_scene_drop_fragments: function () {
    return Libupt.call("upt_scene_drop_fragments", arguments);
  },
  upt_scene_read_node_count__deps: ["$Libupt"],
  upt_scene_read_node_count: function () {
    return Libupt.call("upt_scene_read_node_count", arguments);
  },
  upt_scene_update_surface__deps: ["$Libupt"],
  upt_scene_update_surface: function () {
    return Libupt.call("upt_scene_update_surface", arguments);
  },
  upt_scene_read_surface__deps: ["$Libupt"],
  upt_scene_read_surface: function () {
    return Libupt.call("upt_scene_read_surface", arguments);
  },
  upt_scene_read_surface_positions__deps: ["$Libupt"],
  upt_scene_read_surface_positions: function () {
    return Libupt.call("upt_scene_read_surface_positions", arguments);
  },
  upt_scene_present__deps: ["$Libupt"],
  upt_scene_present: function () {
    return Libupt.call("upt_scene_present", arguments);
  },
  upt_haptics_create__deps: ["$Libupt"],
  upt_haptics_create: function () {
    return Libupt.call("upt_haptics_create", arguments);
  },
  upt_haptics_render__deps: ["$Libupt"],
  upt_haptics_render: function () {
    return Libupt.call("upt_haptics_render", arguments);
  },
  upt_haptics_destroy__deps: ["$Libupt"],
  upt_haptics_destroy: function () {
    return Libupt.call("upt_haptics_destroy", arguments);
  },
  upt_scene_contacts_from_instruments__deps: ["$Libupt"],
  upt_scene_contacts_from_instruments: function () {
    return Libupt.call("upt_scene_contacts_from_instruments", arguments);
  },
  upt_scene_read_contact_force__deps: ["$Libupt"],
  upt_scene_read_contact_force: function () {
    return Libupt.call("upt_scene_read_contact_force", arguments);
  },
  upt_scene_read_stats__deps: ["$Libupt"],
  upt_scene_read_stats: function () {
    return Libupt.call("upt_scene_read_stats", arguments);
  },
  upt_scene_read_timing__deps: ["$Libupt"],
  upt_scene_read_timing: function () {
    return Libupt.call("upt_scene_read_timing", arguments);
  },
  upt_scene_save__deps: ["$Libupt"],
  upt_scene_save: function () {
    return Libupt.call("upt_scene_save", arguments);
  },
  upt_scene_restore__deps: ["$Libupt"],
  upt_scene_restore: function () {
    return Libupt.call("upt_scene_restore", arguments);
  },
  upt_scene_record__deps: ["$Libupt"],
  upt_scene_record: function () {
    return Libupt.call("upt_scene_record", arguments);
  },
  upt_scene_take_record__deps: ["$Libupt"],
  upt_scene_take_record: function () {
    return Libupt.call("upt_scene_take_record", arguments);
  },
};

mergeInto(LibraryManager.library, libupt);
