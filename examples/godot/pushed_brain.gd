# A brain and a spatula. Arguments after "--":
#   --bundle=PATH       the model (default: UPT_BUNDLE in the environment)
#   --frames=N          steps to run, then quit (default: run until the window is closed)
#   --screenshot=FILE   PNG of the window at the deepest push (needs a display)
#   --check             assert the displacements; exit code 1 and a line FAILED when one is wrong
extends Node3D

const SPATULA := 2
const DEPTH := 0.012
const HALF_EXTENTS := Vector3(6.0, 12.0, 1.0)
const ROUNDING := 1.0
const PERIOD := 80

var tissue: SoftTissue3D
var spatula: MeshInstance3D
var rest := PackedVector3Array()
var faces := PackedInt32Array()
var site := Vector3.ZERO
var outward := Vector3.ZERO
var step := 0
var options := {}
var largest := 0.0
var most_contacts := 0
var largest_force := 0.0
var deepest := 0.0
var seen_flags := 0
var upload_ms := 0.0
var finished := false


func _ready() -> void:
	for argument in OS.get_cmdline_user_args():
		var parts := argument.trim_prefix("--").split("=", true, 1)
		options[parts[0]] = parts[1] if parts.size() > 1 else ""
	var bundle: String = options.get("bundle", OS.get_environment("UPT_BUNDLE"))
	tissue = SoftTissue3D.new()
	if not tissue.open(bundle):
		finish("could not open the bundle: " + tissue.message())
		return
	rest = tissue.rest()
	faces = tissue.faces()
	add_child(tissue)
	var material := StandardMaterial3D.new()
	material.vertex_color_use_as_albedo = true
	material.roughness = 0.55
	tissue.material_override = material
	find_site()
	tissue.hold(0.2, false, 0.0)
	build_scene()
	show_surface(rest)


func _physics_process(_delta: float) -> void:
	if finished or rest.is_empty():
		return
	step += 1
	var press := 0.5 - 0.5 * cos(TAU * step / PERIOD)
	var clearance := 0.001 * (HALF_EXTENTS.z + ROUNDING)
	var pose := Transform3D(Basis(Quaternion(Vector3.BACK, outward)), site + outward * (clearance + 0.002 - press * (DEPTH + 0.002)))
	spatula.transform = pose
	if not tissue.press(SPATULA, pose.origin, pose.basis.get_rotation_quaternion(), HALF_EXTENTS, ROUNDING):
		finish("a step failed: " + tissue.message())
		return
	most_contacts = maxi(most_contacts, tissue.contact_count())
	largest_force = maxf(largest_force, tissue.force().length())
	deepest = maxf(deepest, tissue.penetration())
	seen_flags |= tissue.flags()
	var started := Time.get_ticks_usec()
	var now := tissue.vertices()
	show_surface(now)
	upload_ms = maxf(upload_ms, 0.001 * (Time.get_ticks_usec() - started))
	for i in now.size():
		largest = maxf(largest, now[i].distance_to(rest[i]))
	if options.has("screenshot") and step == PERIOD / 2:
		await RenderingServer.frame_post_draw
		var saved := get_viewport().get_texture().get_image().save_png(options["screenshot"])
		if saved != OK:
			finish("could not write " + options["screenshot"])
			return
	if options.has("frames") and step >= int(options["frames"]):
		check_rest()


func check_rest() -> void:
	if options.has("check"):
		if most_contacts == 0:
			finish("the spatula never touched the tissue")
			return
		if largest < 0.005 or largest > 0.03:
			finish("the largest displacement is %.1f mm, expected 5 to 30" % (1000.0 * largest))
			return
		for i in 200:
			tissue.release()
		var left := 0.0
		var now := tissue.vertices()
		for i in now.size():
			left = maxf(left, now[i].distance_to(rest[i]))
		if left > 0.0005:
			finish("10 s after release %.2f mm are left" % (1000.0 * left))
			return
	print("OK %d steps, %d points in contact at most, force at most %.0f mN, penetration at most %.2f mm, flags %d, largest displacement %.2f mm, step %.2f ms, mesh upload at most %.2f ms for %d vertices" % [step, most_contacts, largest_force, deepest, seen_flags, 1000.0 * largest, tissue.step_ms(), upload_ms, rest.size()])
	finish("")


func finish(problem: String) -> void:
	finished = true
	if problem != "":
		printerr("FAILED ", problem)
		print("FAILED ", problem)
	get_tree().quit(0 if problem == "" else 1)


# The surface point farthest to the left at mid height and a little in front: the lateral face of the brain, beside the Sylvian fissure.
func find_site() -> void:
	var best := -INF
	for point in rest:
		var score := -point.x - 0.8 * absf(point.y - 0.005) - 0.5 * absf(point.z - 0.01)
		if score > best:
			best = score
			site = point
	var normal := Vector3.ZERO
	for f in range(0, faces.size(), 3):
		var a := rest[faces[f]]
		if a.distance_to(site) < 0.008:
			normal += (rest[faces[f + 2]] - a).cross(rest[faces[f + 1]] - a)
	outward = normal.normalized()


func build_scene() -> void:
	spatula = MeshInstance3D.new()
	var blade := BoxMesh.new()
	blade.size = 0.002 * (HALF_EXTENTS + Vector3(0, 0, ROUNDING))
	spatula.mesh = blade
	var steel := StandardMaterial3D.new()
	steel.albedo_color = Color(0.55, 0.6, 0.68)
	steel.metallic = 0.3
	steel.roughness = 0.4
	spatula.material_override = steel
	add_child(spatula)
	var camera := Camera3D.new()
	camera.fov = 40.0
	camera.near = 0.01
	add_child(camera)
	var middle := Vector3(0.0, 0.01, 0.02)
	camera.look_at_from_position(middle + Vector3(-0.26, 0.1, -0.13), middle)
	for angles in [Vector3(-0.7, -1.2, 0.0), Vector3(-0.2, -2.6, 0.0)]:
		var sun := DirectionalLight3D.new()
		sun.rotation = angles
		sun.light_energy = 0.75
		add_child(sun)
	var world := WorldEnvironment.new()
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_COLOR
	world.environment.background_color = Color(0.93, 0.94, 0.96)
	world.environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	world.environment.ambient_light_color = Color.WHITE
	world.environment.ambient_light_energy = 0.35
	add_child(world)


func show_surface(points: PackedVector3Array) -> void:
	var normals := PackedVector3Array()
	var colors := PackedColorArray()
	normals.resize(points.size())
	colors.resize(points.size())
	for f in range(0, faces.size(), 3):
		var a := faces[f]
		var b := faces[f + 1]
		var c := faces[f + 2]
		var normal := (points[c] - points[a]).cross(points[b] - points[a])
		normals[a] += normal
		normals[b] += normal
		normals[c] += normal
	var pale := Color(0.87, 0.66, 0.62)
	var deep := Color(0.2, 0.25, 0.75)
	for i in points.size():
		normals[i] = normals[i].normalized()
		colors[i] = pale.lerp(deep, minf(1.0, points[i].distance_to(rest[i]) / DEPTH))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = points
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_COLOR] = colors
	arrays[Mesh.ARRAY_INDEX] = faces
	var mesh := ArrayMesh.new()
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	tissue.mesh = mesh
