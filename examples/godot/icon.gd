# The addon's icon as a picture: godot --headless --script icon.gd -- SVG PNG
extends SceneTree


func _init() -> void:
	var words := OS.get_cmdline_user_args()
	var image := Image.new()
	var status := image.load_svg_from_string(FileAccess.get_file_as_string(words[0]), 16.0)
	if status == OK:
		status = image.save_png(words[1])
	quit(int(status != OK))
