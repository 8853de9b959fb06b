# A brain and a spatula. Each frame shows the tissue of its own moment, steps run beside it. Arguments after "--":
#   --bundle=PATH       the model (default: UPT_BUNDLE in the environment)
#   --seconds=S         how long, then quit (default: until the window is closed)
#   --corrections=N, --target=MM, --substeps=N, --step=S
#                       the tissue's properties of these names (default: what the bundle recommends)
#   --cut               a blade cuts a slit of 30 mm in place of the spatula's push; --check takes it back
#   --tear=STRETCH      what the spatula stretches beyond this tears; --check takes it back
#   --site=X,Y,Z        the tool comes to the point of the surface that is nearest to this, mm, RAS (default: the lateral face of the brain)
#   --bed               a ball hangs on the organ by a bed of ties in place of the spatula, and is drawn off after two seconds
#   --lead=MM           the bundle's first support group goes up by so much in a second, and is let go after 1.5
#   --breathe=MM        what holds the organ goes up and down by so much, once in four seconds
#   --wait              each frame waits for the step in flight: the same pictures on every machine
#   --screenshot=FILE   PNG of the window at the deepest push (needs a display)
#   --check             assert what was shown; exit code 1 and a line FAILED when something is wrong
extends Node3D

const DEPTH := 0.012
# Of the whole blade, mm; its edges are rounded.
const HALF_EXTENTS := Vector3(6.0, 12.0, 1.0)
const ROUNDING := 1.0
const PERIOD := 2.0
const LATER := 0.05
const BREATH := 4.0
# A gall bladder, mm, on its bed: N/m and mN of all ties; and how fast it is drawn off, m/s.
const BLADDER := 9.0
const BED_RADIUS := 15.0
const BED_STIFFNESS := 300.0
const BED_STRENGTH := 400.0
const DRAWN_AFTER := 2.0
const DRAWN := 0.01
# Of a cut, and how deep.
const BLADE := 1
const SLIT := 0.03
const SLIT_DEPTH := 0.008

var tissue: SoftTissue3D
var spatula: MeshInstance3D
# Of what was outside, and of what a blade has laid open.
var materials: Array[StandardMaterial3D] = []
var rest := PackedVector3Array()
var faces := PackedInt32Array()
var changes := 0
var site := Vector3.ZERO
var outward := Vector3.ZERO
# Of the middle of the blade over the site, where it touches nothing yet.
var above := 0.0
var now := 0.0
# Of what holds the organ, m.
var height := 0.0
var ties := 0
var early := 0
var frames := 0
var options := {}
var finished := false
var pictured := false
# Of all frames.
var largest := 0.0
var most_contacts := 0
var largest_force := 0.0
var seen_flags := 0
var most_corrections := 0
var largest_error := 0.0
var shown := PackedVector3Array()
var driven := 0
var stale := 0
var inside := 0.0
var frame_ms := 0.0
var upload_ms := 0.0


func _ready() -> void:
	for argument in OS.get_cmdline_user_args():
		var parts := argument.trim_prefix("--").split("=", true, 1)
		options[parts[0]] = parts[1] if parts.size() > 1 else ""
	var bundle: String = options.get("bundle", OS.get_environment("UPT_BUNDLE"))
	tissue = SoftTissue3D.new()
	tissue.corrections = int(options.get("corrections", "0"))
	tissue.corrections_target_mm = float(options.get("target", "0"))
	tissue.substeps = int(options.get("substeps", "0"))
	tissue.step_s = float(options.get("step", "0"))
	if not tissue.open(bundle):
		finish("could not open the bundle: " + tissue.message())
		return
	rest = tissue.rest()
	shown = rest
	faces = tissue.faces()
	add_child(tissue)
	var material := StandardMaterial3D.new()
	material.vertex_color_use_as_albedo = true
	material.roughness = 0.55
	materials.append(material)
	var flesh := StandardMaterial3D.new()
	flesh.albedo_color = Color(0.55, 0.14, 0.12)
	flesh.roughness = 0.5
	materials.append(flesh)
	find_site()
	tissue.hold(0.2, false, 0.0)
	if options.has("cut"):
		tissue.work_as(BLADE)
	if options.has("tear") and (tissue.tear_at(0.5) or not tissue.tear_at(float(options["tear"]))):
		finish("no limit of stretch: " + tissue.message())
		return
	if options.has("breathe") and not tissue.breathe(0.001 * float(options["breathe"]), BREATH):
		finish("could not breathe: " + tissue.message())
		return
	build_scene()
	show_surface(rest)


func _process(delta: float) -> void:
	if finished or rest.is_empty():
		return
	now += delta
	frames += 1
	height = 0.001 * float(options.get("breathe", "0")) * (0.5 - 0.5 * cos(TAU * now / BREATH))
	var before := spatula.position if frames > 1 else Vector3.INF
	var press := 0.5 - 0.5 * cos(TAU * now / PERIOD)
	var pose := Transform3D(Basis(Quaternion(Vector3.BACK, outward)), site + outward * (above - press * DEPTH))
	if options.has("cut"):
		var aside := outward.cross(Vector3.RIGHT).normalized() * (minf(now / (0.5 * PERIOD), 1.0) - 0.5) * SLIT
		pose = Transform3D(Basis(Quaternion(Vector3.UP, outward)), site + aside + outward * (0.001 * HALF_EXTENTS.y - SLIT_DEPTH))
	if options.has("bed"):
		var drawn := DRAWN * maxf(now - DRAWN_AFTER, 0.0)
		pose = Transform3D(Basis(), site + outward * (0.001 * BLADDER + 0.0005 + drawn) + Vector3.UP * height)
		tissue.press_sphere(pose.origin, BLADDER)
		if ties == 0:
			ties = tissue.hang(site, BED_RADIUS, BED_STIFFNESS, BED_STRENGTH)
		if now < DRAWN_AFTER:
			early = tissue.torn()
	elif options.has("lead"):
		var up := 0.001 * float(options["lead"]) * minf(now, 1.0)
		if not tissue.lead(0, Vector3.UP * up, Quaternion(), now > 1.5):
			finish("could not lead: " + tissue.message())
			return
	else:
		tissue.press_spatula(pose.origin, pose.basis.get_rotation_quaternion(), HALF_EXTENTS, ROUNDING)
	spatula.transform = pose
	var started := Time.get_ticks_usec()
	if not tissue.frame(now):
		finish("a frame failed: " + tissue.message())
		return
	frame_ms = maxf(frame_ms, 0.001 * (Time.get_ticks_usec() - started))
	if options.has("wait"):
		tissue.wait()
	most_contacts = maxi(most_contacts, tissue.contact_count())
	largest_force = maxf(largest_force, tissue.force().length())
	seen_flags |= tissue.flags()
	most_corrections = maxi(most_corrections, tissue.corrections_made())
	largest_error = maxf(largest_error, tissue.error_mm())
	started = Time.get_ticks_usec()
	var points := tissue.vertices()
	if changes != tissue.changes():
		changes = tissue.changes()
		rest = tissue.rest()
		faces = tissue.faces()
		shown = points
	show_surface(points)
	upload_ms = maxf(upload_ms, 0.001 * (Time.get_ticks_usec() - started))
	if options.has("lead"):
		var moved := 0.0
		for i in points.size():
			moved = maxf(moved, points[i].distance_to(rest[i]))
		if now <= 1.5:
			largest = maxf(largest, moved)
		driven = int(1e6 * moved)
	elif not options.has("cut") and not options.has("bed"):
		look(points, pose, before.distance_to(pose.origin) if before.is_finite() else 0.0)
	if options.has("screenshot") and now >= 0.5 * PERIOD and not pictured:
		pictured = true
		await RenderingServer.frame_post_draw
		var saved := get_viewport().get_texture().get_image().save_png(options["screenshot"])
		if saved != OK:
			finish("could not write " + options["screenshot"])
			return
	if options.has("seconds") and now >= float(options["seconds"]):
		check_all()


# What a viewer would see: the tissue goes with the tool in every frame, and the tool is not inside of it.
func look(points: PackedVector3Array, pose: Transform3D, way: float) -> void:
	var moved := 0.0
	var back := pose.affine_inverse()
	var core := 0.001 * (HALF_EXTENTS - Vector3.ONE * ROUNDING)
	for i in points.size():
		moved = maxf(moved, points[i].distance_to(shown[i]))
		largest = maxf(largest, points[i].distance_to(rest[i]))
		# Into the rounded box: the distance to its core, less the rounding.
		var outside := (back * points[i]).abs() - core
		var depth := 0.001 * ROUNDING - outside.max(Vector3.ZERO).length() - minf(0.0, outside[outside.max_axis_index()])
		inside = maxf(inside, depth)
	# The spatula drives the tissue while it goes in, and moves visibly from one frame to the next.
	if tissue.contact_count() > 0 and fposmod(now, PERIOD) < 0.5 * PERIOD and way > 0.00005:
		driven += 1
		if moved < 0.2 * way:
			stale += 1
	shown = points


func problem_of_cut() -> String:
	var area := tissue.cut_area()
	var inside_faces := (faces.size() - tissue.outside()) / 3
	if area < 100.0 or inside_faces < 10 or largest_force == 0.0:
		return "%.0f mm² are cut, %d faces lie inside; the blade feels %.0f mN; expected 100, 10 and more than 0" % [area, inside_faces, largest_force]
	if not tissue.undo() or tissue.cut_area() != 0.0 or tissue.undo():
		return "the one stroke is not taken back"
	if tissue.faces().size() != tissue.outside() or tissue.work_as(7):
		return "there is still something inside, or a tool of no kind"
	print("a slit of %.0f mm²: %d faces inside" % [area, inside_faces])
	return ""


func problem_of_tear() -> String:
	var area := tissue.cut_area()
	if area < 1.0 or faces.size() == tissue.outside() or most_contacts == 0:
		return "the spatula tore %.1f mm²; expected 1" % area
	if not tissue.undo() or tissue.cut_area() != 0.0 or faces.size() == 0:
		return "the tear is not taken back"
	print("the spatula tore %.0f mm²" % area)
	return ""


func problem_of_bed() -> String:
	var left := ties - tissue.torn()
	if ties < 4 or early > 0 or left > 0:
		return "%d ties, %d torn before the ball is drawn off, %d left at the end; expected 4 and more, 0, 0" % [ties, early, left]
	if largest_force < 100.0 or largest_force > 1000.0:
		return "the bed bears %.0f mN at most, expected 100 to 1000" % largest_force
	print("a ball on a bed of %d ties, all torn" % ties)
	return ""


func problem_of_lead() -> String:
	var led := 0.001 * float(options["lead"])
	var left := 1e-6 * driven
	if largest < 0.9 * led or largest > 1.5 * led or left > 0.5 * led:
		return "the group is led %.1f mm, tissue goes %.2f mm, and is %.2f mm off once it is let go" % [1000.0 * led, 1000.0 * largest, 1000.0 * left]
	return ""


func problem_of_all() -> String:
	if options.has("lead"):
		return problem_of_lead()
	if options.has("bed"):
		return problem_of_bed()
	if options.has("cut"):
		return problem_of_cut()
	if options.has("tear"):
		return problem_of_tear()
	if most_contacts == 0:
		return "the spatula never touched the tissue"
	if largest < 0.005 or largest > 0.03:
		return "the largest displacement is %.1f mm, expected 5 to 30" % (1000.0 * largest)
	if options.has("wait"):
		if driven < 20:
			return "the spatula drives the tissue in %d frames, expected 20" % driven
		if stale > 0:
			return "in %d of %d frames the tissue does not go with the spatula" % [stale, driven]
		if inside > 0.0005:
			return "a point is shown %.2f mm inside of the spatula" % (1000.0 * inside)
	# Without a target each step in contact, which is one step, gets all of them.
	var most := tissue.corrections
	if most != 0 and tissue.corrections_target_mm == 0.0 and most_corrections != maxi(most, 0):
		return "%d corrections were made in a step, the property says %d" % [most_corrections, most]
	if most > 0 and tissue.substeps == 1 and most_corrections > most:
		return "%d corrections were made in a step, %d at most are wanted" % [most_corrections, most]
	# Ten seconds later, in slow frames: each makes the steps that came due before it.
	tissue.release()
	tissue.breathe(0.0, BREATH)
	for i in 200:
		now += LATER
		tissue.frame(now)
		tissue.wait()
	var left := 0.0
	var points := tissue.vertices()
	for i in points.size():
		left = maxf(left, points[i].distance_to(rest[i]))
	if left > 0.0005:
		return "10 s after release %.2f mm are left" % (1000.0 * left)
	return ""


func check_all() -> void:
	finished = true
	var problem := problem_of_all() if options.has("check") else ""
	if problem == "":
		print("OK %d frames, %d points in contact at most, force at most %.0f mN, flags %d, at most %d corrections a step with an error of %.3f mm, largest displacement %.2f mm, %.2f mm inside of the spatula at most, still in %d of %d frames, frame at most %.2f ms, mesh upload at most %.2f ms for %d vertices" % [frames, most_contacts, largest_force, seen_flags, most_corrections, largest_error, 1000.0 * largest, 1000.0 * inside, stale, driven, frame_ms, upload_ms, rest.size()])
	finish(problem)


func finish(problem: String) -> void:
	finished = true
	if problem != "":
		printerr("FAILED ", problem)
		print("FAILED ", problem)
	get_tree().quit(0 if problem == "" else 1)


# The point that was asked for; else the surface point farthest to the left at mid height and a little in front: the lateral face of the brain, beside the Sylvian fissure.
func find_site() -> void:
	var best := -INF
	var given: PackedFloat64Array = options.get("site", "").split_floats(",", false)
	for point in rest:
		var score := -point.x - 0.8 * absf(point.y - 0.005) - 0.5 * absf(point.z - 0.01)
		if given.size() == 3:
			score = -point.distance_to(0.001 * Vector3(given[0], given[2], -given[1]))
		if score > best:
			best = score
			site = point
	var normal := Vector3.ZERO
	for f in range(0, faces.size(), 3):
		var a := rest[faces[f]]
		if a.distance_to(site) < 0.008:
			normal += (rest[faces[f + 2]] - a).cross(rest[faces[f + 1]] - a)
	outward = normal.normalized()
	# Free of all of the surface under the blade, which is nowhere flat.
	var turn := Basis(Quaternion(Vector3.BACK, outward)).inverse()
	for point in rest:
		var local := turn * (point - site)
		if absf(local.x) < 0.001 * HALF_EXTENTS.x and absf(local.y) < 0.001 * HALF_EXTENTS.y and local.length() < 0.02:
			above = maxf(above, local.z + 0.001 * HALF_EXTENTS.z)
	above += 0.0005


func build_scene() -> void:
	spatula = MeshInstance3D.new()
	if options.has("bed"):
		var ball := SphereMesh.new()
		ball.radius = 0.001 * BLADDER
		ball.height = 0.002 * BLADDER
		spatula.mesh = ball
	else:
		var blade := BoxMesh.new()
		blade.size = 0.002 * HALF_EXTENTS
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
	if options.has("site"):
		camera.look_at_from_position(site + 0.2 * outward + Vector3(-0.14, 0.12, 0.0), site)
	else:
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
		colors[i] = pale.lerp(deep, minf(1.0, points[i].distance_to(rest[i] + Vector3.UP * height) / DEPTH))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = points
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_COLOR] = colors
	var mesh := ArrayMesh.new()
	var outside := tissue.outside()
	for part in [faces.slice(0, outside), faces.slice(outside)]:
		if part.size() > 0:
			arrays[Mesh.ARRAY_INDEX] = part
			mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
			mesh.surface_set_material(mesh.get_surface_count() - 1, materials[mesh.get_surface_count() - 1])
	tissue.mesh = mesh
