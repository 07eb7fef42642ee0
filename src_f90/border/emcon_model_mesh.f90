!> The C functions that tell the mesh of a model, in Fortran. What each does is said in emcon.h.
module emcon_model_mesh
   use emcon_errors, only : err_input, error_t, raise
   use emcon_mesh, only : named_set_t
   use emcon_model, only : model_t
   use emcon_text, only : to_upper
   implicit none
   private
   public :: model_elements, model_find_elements, model_find_faces, model_names, model_bodies

   !> What emcon.h says of the most nodes and faces of an element.
   integer, parameter :: most_nodes = 20, most_faces = 6

contains

   pure subroutine model_elements(model, label, kind, node)
      type(model_t), intent(in) :: model
      integer, allocatable, intent(out) :: label(:)          !! (n_element)
      integer, allocatable, intent(out) :: kind(:)           !! (n_element) VTK's number
      integer, allocatable, intent(out) :: node(:, :)        !! (most_nodes, n_element), 0: none
      integer :: e, n

      associate (scene => model%stepper%scene)
         allocate(label, source=scene%element%label)
         allocate(kind(size(label)), node(most_nodes, size(label)))
         node = 0
         do e = 1, size(label)
            associate (of => scene%element%kinds(scene%element%kind(e)))
               kind(e) = of%vtk_type
               n = min(of%n_vtk, most_nodes)
               node(:n, e) = scene%element%node(:n, e)
            end associate
         end do
      end associate
   end subroutine model_elements

   pure subroutine model_find_elements(model, name, is_in, error)
      type(model_t), intent(in) :: model
      character(len=*), intent(in) :: name
      logical, allocatable, intent(out) :: is_in(:)          !! (n_element)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      associate (scene => model%stepper%scene)
         allocate(is_in(size(scene%element%label)), source=.false.)
         do k = 1, size(scene%set%element)
            if (scene%set%element(k)%name == to_upper(name)) exit
         end do
         if (k > size(scene%set%element)) then
            call raise(error, err_input, "there is no element set " // name)
         else
            is_in(scene%set%element(k)%item) = .true.
         end if
      end associate
   end subroutine model_find_elements

   pure subroutine model_find_faces(model, name, is_in, error)
      type(model_t), intent(in) :: model
      character(len=*), intent(in) :: name
      logical, allocatable, intent(out) :: is_in(:, :)       !! (most_faces, n_element)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k

      associate (scene => model%stepper%scene)
         allocate(is_in(most_faces, size(scene%element%label)), source=.false.)
         do k = 1, size(scene%surface)
            if (to_upper(scene%surface(k)%name) == to_upper(name)) exit
         end do
         if (k > size(scene%surface)) then
            call raise(error, err_input, "there is no surface " // name)
            return
         end if
         if (.not. allocated(scene%surface(k)%element)) return
         do i = 1, size(scene%surface(k)%element)
            is_in(scene%surface(k)%face(i), scene%surface(k)%element(i)) = .true.
         end do
      end associate
   end subroutine model_find_faces

   !> A line for each, the kind before the name.
   pure subroutine model_names(model, text)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(out) :: text
      integer :: k

      text = ""
      associate (scene => model%stepper%scene)
         call add_sets("node set ", scene%set%node, text)
         call add_sets("element set ", scene%set%element, text)
         do k = 1, size(scene%surface)
            text = text // "surface " // scene%surface(k)%name // new_line("a")
         end do
      end associate
   end subroutine model_names

   pure subroutine add_sets(what, set, text)
      character(len=*), intent(in) :: what       !! is before each name
      type(named_set_t), intent(in) :: set(:)
      character(len=:), allocatable, intent(inout) :: text
      integer :: k

      do k = 1, size(set)
         text = text // what // set(k)%name // new_line("a")
      end do
   end subroutine add_sets

   pure subroutine model_bodies(model, body)
      type(model_t), intent(in) :: model
      integer, allocatable, intent(out) :: body(:)           !! (n_node) 0: of none

      allocate(body, source=model%stepper%march%system%space%body)
   end subroutine model_bodies

end module emcon_model_mesh
