# Each shape of a tool presses an organ from above, and feels it:
#   godot --headless --path PROJECT --script shapes.gd -- BUNDLE
extends SceneTree

const DEPTH := 0.004
const HALF := Vector3(5.0, 4.0, 6.0)  # mm

var tissue := SoftTissue3D.new()


func _init() -> void:
	if not tissue.open(OS.get_cmdline_user_args()[0]):
		finish("could not open the bundle: " + tissue.message())
		return
	var top := Vector3(0.0, -INF, 0.0)  # m
	for point in tissue.rest():
		if point.y > top.y:
			top = point
	# A capsule and a box that lie along x, which is their own y.
	var lying := Quaternion(Vector3.BACK, 0.5 * PI)
	var felt := []
	for press: Callable in [
		func(way: float) -> bool: return tissue.press_sphere(top + Vector3.UP * (0.005 - way), 5.0),
		func(way: float) -> bool: return tissue.press_capsule(top + Vector3.UP * (0.005 - way), lying, 8.0, 5.0),
		func(way: float) -> bool: return tissue.press_box(top + Vector3.UP * (0.001 * HALF.x - way), lying, HALF),
		func(way: float) -> bool: return tissue.press_spatula(top + Vector3.UP * (0.001 * HALF.x - way), lying, HALF, 2.0),
	]:
		if not tissue.open(OS.get_cmdline_user_args()[0]):
			finish(tissue.message())
			return
		for frame in 31:
			if not press.call(DEPTH * frame / 30) or not tissue.frame(frame / 60.0):
				finish(tissue.message())
				return
			tissue.wait()
		felt.append(roundi(tissue.force().y))
	# The wider the tool, the more it feels; rounded edges take a little of it away.
	if felt[0] < 20 or felt[1] < 1.1 * felt[0] or felt[2] < 1.1 * felt[0] or felt[3] >= felt[2]:
		finish("a sphere, a capsule, a box and a spatula feel %s mN" % [felt])
	elif tissue.press_sphere(top, -1.0) and tissue.frame(1.0):
		finish("a sphere of -1 mm presses")
	else:
		print("OK a sphere, a capsule, a box and a spatula feel %s mN; -1 mm: %s" % [felt, tissue.message()])
		finish("")


func finish(problem: String) -> void:
	if problem != "":
		print("FAILED ", problem)
	tissue.free()
	quit(0 if problem == "" else 1)
