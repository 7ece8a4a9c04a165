// Nothing: the target trigmesh_tests_headers needs one source to be compiled with.
