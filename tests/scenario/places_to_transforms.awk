# A places file (pipeline/run/places.h) → transforms.json of the views whose flags match `flags` (a pattern: "s").
$1 == "lens" { lens[n_lens++] = $0 }
$1 == "view" && $4 ~ flags {
    split(lens[$3], l)
    printf "%s{\"file_path\": \"%s.png\", \"camera_model\": \"%s\", \"w\": %d, \"h\": %d, \"fl_x\": %s, \"fl_y\": %s, \"cx\": %s, \"cy\": %s,", n++ ? ",\n" : "{\"frames\": [\n", $2, l[2] == 2 ? "OPENCV_FISHEYE" : "OPENCV", l[3], l[4], l[5], l[6], l[7], l[8]
    printf " \"k1\": %s, \"k2\": %s, \"k3\": %s, \"k4\": %s, \"p1\": %s, \"p2\": %s,\n", l[9], l[10], l[11], l[12], l[13], l[14]
    # nerfstudio's cameras look along −z, their y is up.
    printf " \"transform_matrix\": [[%s, %.17g, %.17g, %s], [%s, %.17g, %.17g, %s], [%s, %.17g, %.17g, %s], [0, 0, 0, 1]]}", $5, -$6, -$7, $8, $9, -$10, -$11, $12, $13, -$14, -$15, $16
}
END { print "\n]}" }
