! build: holder
!> A model without solids, for a host code that has its own: nodes, surfaces as edges, in space as
!> faces, pairs, ties.
!>
!> `stepper_new` in place of reading a deck; then surfaces, pairs, ties and held freedoms, and
!> `stepper_build`. What the host then asks for in each step: emcon_stepper_contact. Nodes that no
!> surface holds may be left out. Edges run with the body to the left, so the outward normal is the
!> edge turned by -90 degrees; faces run counter-clockwise seen from outside. The plane has
!> thickness 1. Rigid obstacles: surfaces of held nodes.
!> Source: docs/theory.md, sections 4, 5 and 10.
module emcon_stepper_host
   use emcon_couplings, only : tie_t
   use emcon_csr, only : csr_from_values, csr_t
   use emcon_element_registry, only : element_kinds_create
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_host_faces, only : host_faces_in_turn
   use emcon_interactions, only : contact_damping_t, contact_options_t, contact_pair_t, &
      formulation_mortar, &
      formulation_nts, integration_elements, integration_segments, interaction_t, &
      multiplier_dual, multiplier_standard, normal_edge, normal_nodal, smoothing_hermite, &
      smoothing_none
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_of_nodes
   use emcon_scheme_registry, only : scheme_row
   use emcon_sort, only : find_sorted
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_choice, check_field, check_number, check_that, &
      stepper_check_open
   use emcon_steps, only : initiation_admissible, initiation_persistent, prescribed_t
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : to_text
   implicit none
   private
   public :: stepper_new, stepper_add_surface, stepper_add_faces, stepper_add_pair, &
      stepper_add_tie, stepper_hold, &
      stepper_set_contact, stepper_tie_matrices

   !> Gauss points at most, as in a deck.
   integer, parameter :: most_points = 10
   real(wp), parameter :: half_turn = 180.0_wp   !! [degrees]

contains

   !> Begin with the nodes of the host.
   subroutine stepper_new(self, x, error)
      type(stepper_t), intent(out) :: self
      real(wp), intent(in) :: x(:, :)                      !! (n_dim, n_node) in the reference [L]
      type(error_t), allocatable, intent(out) :: error

      call check_choice("n_dim", size(x, 1), 2, 3, error)
      call check_that(size(x, 2) > 0, "x has no nodes", error)
      if (allocated(error)) return
      call scene_of_nodes(self%scene, x)
      call check_field("x", x, self%scene, error)
      if (allocated(error)) return
      self%scene%host%is_whole = .true.
      self%scene%step(1)%scheme = scheme_row("DYNAMIC", "")
      call element_kinds_create(self%scene%n_dim, self%scene%element%kinds)
      allocate(self%diagnostic(0))
      self%is_read = .true.
   end subroutine stepper_new

   !> Add a surface: edges in any order, in one or several connected parts, open or closed.
   subroutine stepper_add_surface(self, name, edge, surface, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name                 !! for messages; empty: its number
      integer, intent(in) :: edge(:, :)                    !! (2, n_edge) first and last node
      integer, intent(out) :: surface                      !! its number, from 1
      type(error_t), allocatable, intent(out) :: error

      surface = 0
      call check_stage(self, error)
      call check_edges(edge, self%scene%x, error)
      if (.not. allocated(error)) call add_facets(self, name, edge, surface, error)
   end subroutine stepper_add_surface

   !> Add a surface of faces of several kinds, in any order, in one or several connected parts, open
   !> or closed: in space triangles and quadrilaterals, in the plane edges.
   subroutine stepper_add_faces(self, name, kind, offset, node, surface, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name                 !! for messages; empty: its number
      integer, intent(in) :: kind(:)                       !! (n_face) as VTK numbers cells
      integer, intent(in) :: offset(:)                     !! (n_face) nodes up to and with a face's
      integer, intent(in) :: node(:)                       !! of all faces: of each corners first
      integer, intent(out) :: surface                      !! its number, from 1
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: facet(:, :)

      surface = 0
      call check_stage(self, error)
      if (.not. allocated(error)) call host_faces_in_turn(kind, offset, node, self%scene%x, facet, &
         error)
      if (.not. allocated(error)) call add_facets(self, name, facet, surface, error)
   end subroutine stepper_add_faces

   subroutine add_facets(self, name, facet, surface, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: facet(:, :)                   !! (most, n_facet)
      integer, intent(inout) :: surface
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: new
      type(facets_t) :: facets

      new%name = name
      if (name == "") new%name = to_text(size(self%scene%surface) + 1)
      allocate(new%element(0), new%face(0))
      allocate(new%edge, source=facet)
      call facets_init(facets, self%scene, new, error)
      if (allocated(error)) return
      self%scene%surface = [self%scene%surface, new]
      surface = size(self%scene%surface)
   end subroutine add_facets

   !> Edges of a surface: existing nodes, and a length.
   pure subroutine check_edges(edge, x, error)
      integer, intent(in) :: edge(:, :)
      real(wp), intent(in) :: x(:, :)            !! (2, n_node)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      call check_that(size(edge, 1) == 2 .and. size(edge, 2) > 0, "edge has the shape (" // &
         to_text(size(edge, 1)) // ", " // to_text(size(edge, 2)) // &
         "), not (2, n_edge) with n_edge > 0", error)
      call check_that(size(edge, 1) == size(x, 1), "surfaces of edges are of the plane, and " // &
         "nodes have " // to_text(size(x, 1)) // " coordinates: add faces", error)
      do i = 1, size(edge, 2)
         call check_choice("edge(1, " // to_text(i) // ")", edge(1, i), 1, size(x, 2), error)
         call check_choice("edge(2, " // to_text(i) // ")", edge(2, i), 1, size(x, 2), error)
         if (allocated(error)) return
         call check_that(any(abs(x(:, edge(1, i)) - x(:, edge(2, i))) > 0.0_wp), "edge(:, " // &
            to_text(i) // ") = " // to_text(edge(1, i)) // ", " // to_text(edge(2, i)) // &
            " has no length", error)
      end do
   end subroutine check_edges

   !> Add a contact pair; a surface in contact with itself is its own master. Of `interaction` hosts
   !> have friction and damping.
   subroutine stepper_add_pair(self, slave, master, formulation, options, error, interaction, &
      adjust)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: slave, master                 !! numbers of surfaces
      integer, intent(in) :: formulation                   !! one of `formulation_`
      type(contact_options_t), intent(in) :: options
      type(error_t), allocatable, intent(out) :: error
      type(interaction_t), intent(in), optional :: interaction       !! none: without either
      !> Slave nodes no farther from the master than this, and those behind it, are moved onto it
      !> before the first step; none, or 0: none are [L]
      real(wp), intent(in), optional :: adjust
      type(contact_pair_t) :: pair

      if (present(interaction)) then
         pair%interaction%friction = interaction%friction
         pair%interaction%damping = interaction%damping
      end if
      call check_surfaces(self, slave, master, error)
      call check_choice("formulation", formulation, formulation_nts, formulation_mortar, error)
      call check_options(options, error)
      if (self%scene%n_dim == 3) call check_space(formulation, options, error)
      call check_number("friction", pair%interaction%friction, error, 0.0_wp)
      call check_damping(pair%interaction%damping, error)
      if (present(adjust)) call check_number("adjust", adjust, error, 0.0_wp)
      call check_apart(self, slave, master, error)
      if (allocated(error)) return
      pair%slave = slave
      pair%master = master
      pair%formulation = formulation
      pair%has_options = .true.
      pair%options = options
      if (present(adjust)) pair%adjust%distance = merge(adjust, -1.0_wp, adjust > 0.0_wp)
      self%scene%pair = [self%scene%pair, pair]
   end subroutine stepper_add_pair

   pure subroutine check_damping(damping, error)
      type(contact_damping_t), intent(in) :: damping
      type(error_t), allocatable, intent(inout) :: error

      call check_number("damping", damping%coefficient, error, 0.0_wp)
      call check_number("the clearance of damping", damping%clearance, error, 0.0_wp)
      call check_number("the flat part of damping", damping%flat, error, 0.0_wp, 1.0_wp)
      call check_number("tangent_fraction", damping%tangent, error, 0.0_wp)
   end subroutine check_damping

   pure subroutine check_options(options, error)
      type(contact_options_t), intent(in) :: options
      type(error_t), allocatable, intent(inout) :: error

      call check_choice("integration", options%integration, integration_segments, &
         integration_elements, error)
      call check_choice("multiplier", options%multiplier, multiplier_standard, multiplier_dual, &
         error)
      call check_choice("normal", options%normal, normal_edge, normal_nodal, error)
      call check_choice("smoothing", options%smoothing, smoothing_none, smoothing_hermite, error)
      if (options%n_point /= 0) call check_choice("n_point", options%n_point, &
         merge(2, 1, options%integration == integration_segments), most_points, error)
      call check_number("normal_angle", options%normal_angle, error, 0.0_wp, half_turn)
      call check_number("smoothing_angle", options%smoothing_angle, error, 0.0_wp, half_turn)
   end subroutine check_options

   !> In space contact is of nodes on faces as they are, or mortar between these.
   pure subroutine check_space(formulation, options, error)
      integer, intent(in) :: formulation
      type(contact_options_t), intent(in) :: options
      type(error_t), allocatable, intent(inout) :: error

      call check_that(any(formulation == [formulation_nts, formulation_mortar]), &
         "formulation is " // to_text(formulation) // ": contact in three dimensions is node to " &
         // "segment (" // to_text(formulation_nts) // ") or mortar (" // &
         to_text(formulation_mortar) // ")", error)
      call check_that(options%smoothing == smoothing_none, "smoothing is of the plane: surfaces " &
         // "in three dimensions are taken as they are", error)
   end subroutine check_space

   !> The two surfaces of a pair share no node.
   subroutine check_apart(self, slave, master, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: slave, master
      type(error_t), allocatable, intent(inout) :: error
      logical, allocatable :: is_slave(:)
      integer, allocatable :: node(:)
      integer :: i

      if (slave == master .or. allocated(error)) return
      allocate(is_slave(size(self%scene%x, 2)), source=.false.)
      associate (one => self%scene%surface(slave), other => self%scene%surface(master))
         call surface_nodes(self%scene, one, node)
         is_slave(node) = .true.
         call surface_nodes(self%scene, other, node)
         i = findloc(is_slave(node), .true., 1)
         if (i > 0) call check_that(.false., "slave surface " // one%name // " and master " // &
            "surface " // other%name // " of a pair share node " // to_text(node(i)), error)
      end associate
   end subroutine check_apart

   !> Add a tie of two surfaces that meet, whatever their meshes.
   subroutine stepper_add_tie(self, slave, master, multiplier, tolerance, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: slave, master                 !! numbers of surfaces
      integer, intent(in) :: multiplier                    !! one of `multiplier_`
      real(wp), intent(in) :: tolerance                    !! how far apart [L]; < 0: a tenth of an
                                                           !! edge
      type(error_t), allocatable, intent(out) :: error
      type(tie_t) :: tie

      call check_surfaces(self, slave, master, error)
      call check_choice("multiplier", multiplier, multiplier_standard, multiplier_dual, error)
      call check_number("tolerance", tolerance, error)
      if (allocated(error)) return
      call check_that(slave /= master, "slave and master are both surface " // &
         self%scene%surface(slave)%name, error)
      if (allocated(error)) return
      tie%name = to_text(size(self%scene%tie) + 1) // " (" // &
         self%scene%surface(slave)%name // " on " // self%scene%surface(master)%name // ")"
      tie%slave = slave
      tie%master = master
      tie%multiplier = multiplier
      tie%tolerance = tolerance
      self%scene%tie = [self%scene%tie, tie]
   end subroutine stepper_add_tie

   !> Both surfaces exist.
   subroutine check_surfaces(self, slave, master, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: slave, master
      type(error_t), allocatable, intent(inout) :: error

      call check_stage(self, error)
      if (allocated(error)) return
      call check_choice("slave", slave, 1, size(self%scene%surface), error)
      call check_choice("master", master, 1, size(self%scene%surface), error)
   end subroutine check_surfaces

   !> Freedoms that the host moves by itself; of several calls the last one counts.
   subroutine stepper_hold(self, held, error)
      type(stepper_t), intent(inout) :: self
      logical, intent(in) :: held(:, :)                    !! (n_dim, n_node)
      type(error_t), allocatable, intent(out) :: error
      type(prescribed_t), allocatable :: list(:)
      integer :: d, i

      call check_stage(self, error)
      if (allocated(error)) return
      call check_that(all(shape(held) == shape(self%scene%x)), "held is to have " // &
         to_text(self%scene%n_dim) // " flags at each of " // to_text(size(self%scene%x, 2)) // &
         " nodes, not " // to_text(size(held, 1)) // " at " // to_text(size(held, 2)), error)
      if (allocated(error)) return
      allocate(list(size(held)))
      list%node = [((i, d = 1, size(held, 1)), i = 1, size(held, 2))]
      list%dof = [((d, d = 1, size(held, 1)), i = 1, size(held, 2))]
      self%scene%step(1)%prescribed = pack(list, reshape(held, [size(held)]))
   end subroutine stepper_hold

   !> How contact begins, also between steps; unchanged after an error. A persistent one holds the
   !> gap that its first step begins with, which keeps energy; an admissible one closes it.
   subroutine stepper_set_contact(self, initiation, gap_tolerance, may_cut, is_end, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: initiation          !! persistent or admissible
      real(wp), intent(in) :: gap_tolerance      !! largest that contact begins at, per edge; 0: any
      logical, intent(in) :: may_cut             !! the host can try a step again in smaller parts
      !> Statics: gradients at the end of the step, where new contacts are closed. Where this is set
      !> before the model is built, corners are those of decks with static steps.
      logical, intent(in) :: is_end
      type(error_t), allocatable, intent(out) :: error

      call check_hosted(self, error)
      call check_choice("initiation", initiation, initiation_persistent, initiation_admissible, &
         error)
      call check_number("gap_tolerance", gap_tolerance, error, least=0.0_wp)
      if (allocated(error)) return
      self%may_cut = may_cut
      self%scene%step(1)%contact%initiation = initiation
      self%scene%step(1)%contact%gap_tolerance = gap_tolerance
      self%scene%step(1)%scheme = scheme_row("DYNAMIC", "")
      if (is_end) self%scene%step(1)%scheme = scheme_row("STATIC", "")
   end subroutine stepper_set_contact

   !> D and M of tie `tie`, over nodes: D x = M x in each direction. A row for each multiplier.
   subroutine stepper_tie_matrices(self, tie, d, m, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: tie                           !! from 1, in the order of the model
      type(csr_t), intent(out) :: d, m                     !! (n_row x n_node) [L]
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:), slave(:)
      logical, allocatable :: is_slave(:)
      integer :: k, s

      call stepper_check_open(self, error)
      if (allocated(error)) return
      call check_choice("tie", tie, 1, size(self%scene%tie), error)
      if (allocated(error)) return
      call surface_nodes(self%scene, self%scene%surface(self%scene%tie(tie)%slave), slave)
      associate (rows => self%scene%tie(tie)%rows, n_node => size(self%scene%x, 2))
         allocate(row(size(rows%node)), is_slave(size(rows%node)))
         do k = 1, size(rows%slave)
            row(rows%start(k) + 1:rows%start(k + 1)) = k
         end do
         do s = 1, size(rows%node)
            is_slave(s) = find_sorted(slave, rows%node(s)) > 0
         end do
         column = merge(rows%node, 0, is_slave)
         call csr_from_values(d, size(rows%slave), n_node, row, column, rows%weight)
         column = merge(0, rows%node, is_slave)
         call csr_from_values(m, size(rows%slave), n_node, row, column, -rows%weight)
      end associate
   end subroutine stepper_tie_matrices

   !> The model is one of a host, and not built yet.
   subroutine check_stage(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_hosted(self, error)
      call check_that(.not. allocated(self%march%scheme), &
         "surfaces, pairs, ties and held freedoms are given before the model is built", error)
   end subroutine check_stage

   subroutine check_hosted(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_that(self%is_read, &
         "there are no nodes: making the model, or building it, failed", error)
      call check_that(self%scene%host%is_whole, &
         "a deck says this itself: it is for models of a host's nodes", error)
   end subroutine check_hosted

end module emcon_stepper_host
